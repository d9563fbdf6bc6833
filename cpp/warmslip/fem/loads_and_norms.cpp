// Load vectors, exact norms and distances to given functions: everything that integrates over a mesh.
#include "warmslip/fem/operators.hpp"
#include "warmslip/physics/p1.hpp"

namespace warmslip {

template <int d>
LoadQuadrature<d>::LoadQuadrature(const Layout<d>& layout, const std::optional<std::string>& part, int points)
    : layout_(layout), rule_(points == 0 ? vertex_rule(part ? d - 1 : d) : simplex_rule(part ? d - 1 : d, points)) {
  const Mesh<d>& mesh = layout.mesh();
  std::vector<double> measures;
  if (part) {
    const Facets<d>& facets = mesh.part(*part);
    std::vector<Eigen::Index> mine;
    for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f)
      if (layout.owns_cell(facets.cells[static_cast<std::size_t>(f)])) mine.push_back(f);
    nodes_.resize(static_cast<Eigen::Index>(mine.size()), d);
    for (std::size_t f = 0; f < mine.size(); ++f) {
      const Eigen::Index cell = layout.local_cell(facets.cells[static_cast<std::size_t>(mine[f])]);
      cells_.push_back(cell);
      measures.push_back(area_normal(mesh, facets, mine[f]).norm());
      for (int i = 0; i < d; ++i)
        for (int j = 0; j <= d; ++j) {  // the local number of the facet's node, through its cell
          const Index local = layout.local_cells()(cell, j);
          if (layout.mesh_nodes()[static_cast<std::size_t>(local)] == facets.nodes(mine[f], i))
            nodes_(static_cast<Eigen::Index>(f), i) = local;
        }
    }
  } else {
    nodes_ = layout.local_cells();
    for (Eigen::Index c = 0; c < layout.cells(); ++c) {
      cells_.push_back(c);
      measures.push_back(simplex<d>(vertices(mesh, layout.mesh_cells()[static_cast<std::size_t>(c)])).volume);
    }
  }
  measures_ = Eigen::Map<Eigen::VectorXd>(measures.data(), static_cast<Eigen::Index>(measures.size()));
  const Eigen::Index per = rule_.weights.size();
  positions_.setZero(nodes_.rows() * per, d);
  for (Eigen::Index s = 0; s < nodes_.rows(); ++s)
    for (Eigen::Index q = 0; q < per; ++q)
      for (Eigen::Index i = 0; i < nodes_.cols(); ++i)
        positions_.row(s * per + q) +=
            rule_.barycentric(q, i) * mesh.nodes.row(layout.mesh_nodes()[static_cast<std::size_t>(nodes_(s, i))]);
}

template <int d>
VecHandle LoadQuadrature<d>::load(const RealTable<Eigen::Dynamic>& values) const {
  if (values.rows() != positions_.rows())
    throw std::invalid_argument("a load needs one row for each of the " + std::to_string(positions_.rows()) +
                                " quadrature points, got " + std::to_string(values.rows()));
  const Eigen::Index block = values.cols();
  VecHandle v = layout_.vector(static_cast<int>(block));
  const Eigen::Index per = rule_.weights.size();
  Vec form;
  WARMSLIP_PETSC(VecGhostGetLocalForm(v, &form));
  {
    Values entries(form);
    for (Eigen::Index s = 0; s < nodes_.rows(); ++s)
      for (Eigen::Index q = 0; q < per; ++q)
        for (Eigen::Index i = 0; i < nodes_.cols(); ++i)
          (*entries).segment(nodes_(s, i) * block, block) +=
              measures_[s] * rule_.weights[q] * rule_.barycentric(q, i) * values.row(s * per + q).transpose();
  }
  WARMSLIP_PETSC(VecGhostRestoreLocalForm(v, &form));
  WARMSLIP_PETSC(VecGhostUpdateBegin(v, ADD_VALUES, SCATTER_REVERSE));
  WARMSLIP_PETSC(VecGhostUpdateEnd(v, ADD_VALUES, SCATTER_REVERSE));
  return v;
}

template <int d>
void LoadQuadrature<d>::expect(const RealTable<Eigen::Dynamic>& values, Vec field, Eigen::Index components) const {
  const Eigen::Index block = block_size(field);
  if (values.rows() != positions_.rows() || block != components)
    throw std::invalid_argument("expected one row for each of the " + std::to_string(positions_.rows()) +
                                " quadrature points and a field of " + std::to_string(components) +
                                " components, got " + std::to_string(values.rows()) + " and " + std::to_string(block));
}

template <int d>
double LoadQuadrature<d>::squared_distance(Vec field, const RealTable<Eigen::Dynamic>& values) const {
  expect(values, field, values.cols());
  const Eigen::VectorXd local = layout_.local(field);
  const Eigen::Index block = values.cols();
  const Eigen::Index per = rule_.weights.size();
  double total = 0;
  for (Eigen::Index s = 0; s < nodes_.rows(); ++s)
    for (Eigen::Index q = 0; q < per; ++q) {
      Eigen::VectorXd difference = -values.row(s * per + q).transpose();
      for (Eigen::Index i = 0; i < nodes_.cols(); ++i)
        difference += rule_.barycentric(q, i) * local.segment(nodes_(s, i) * block, block);
      total += measures_[s] * rule_.weights[q] * difference.squaredNorm();
    }
  return layout_.sum(total);
}

template <int d>
double LoadQuadrature<d>::squared_strain_distance(Vec field, const RealTable<Eigen::Dynamic>& values) const {
  expect(values, field, d);
  if (values.cols() != Eigen::Index{d} * d)
    throw std::invalid_argument("gradients need " + std::to_string(d * d) + " columns, got " +
                                std::to_string(values.cols()));
  const Eigen::VectorXd local = layout_.local(field);
  const Eigen::Index per = rule_.weights.size();
  double total = 0;
  for (Eigen::Index s = 0; s < nodes_.rows(); ++s) {
    const Eigen::Index cell = cells_[static_cast<std::size_t>(s)];
    const Simplex<d> shape = simplex<d>(vertices(layout_.mesh(), layout_.mesh_cells()[static_cast<std::size_t>(cell)]));
    Eigen::Matrix<double, d*(d + 1), 1> nodal;
    for (int i = 0; i <= d; ++i)
      nodal.template segment<d>(i * d) = local.segment<d>(layout_.local_cells()(cell, i) * d);
    const Mandel<d> strain = strain_matrix<d>(shape) * nodal;
    for (Eigen::Index q = 0; q < per; ++q) {
      Tensor2<d> gradient;
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) gradient(i, j) = values(s * per + q, i * d + j);
      total += measures_[s] * rule_.weights[q] * (strain - to_mandel<d>(gradient)).squaredNorm();
    }
  }
  return layout_.sum(total);
}

template <int d>
Norms<d>::Norms(const Layout<d>& layout) : layout_(layout) {
  for (const Index cell : layout.mesh_cells()) cells_.push_back(simplex<d>(vertices(layout.mesh(), cell)));
}

// int |v|^2 = volume / ((d+1)(d+2)) (sum_i |v_i|^2 + |sum_i v_i|^2) on a simplex
template <int d>
template <int block>
double Norms<d>::squared_l2(const Eigen::VectorXd& local) const {
  double total = 0;
  for (Eigen::Index c = 0; c < layout_.cells(); ++c) {
    Eigen::Matrix<double, block, d + 1> nodal;
    for (int i = 0; i <= d; ++i) nodal.col(i) = local.segment<block>(layout_.local_cells()(c, i) * block);
    total += cells_[static_cast<std::size_t>(c)].volume * (nodal.squaredNorm() + nodal.rowwise().sum().squaredNorm());
  }
  return total / ((d + 1) * (d + 2));
}

template <int d>
double Norms<d>::l2(Vec v) const {
  const Eigen::Index block = block_size(v);
  if (block != 1 && block != d)
    throw std::invalid_argument("an L2 norm is for scalars and for vectors of the space's dimension");
  const Eigen::VectorXd local = layout_.local(v);
  return std::sqrt(layout_.sum(block == 1 ? squared_l2<1>(local) : squared_l2<d>(local)));
}

template <int d>
double Norms<d>::v(Vec v) const {
  const Eigen::Index block = block_size(v);
  if (block != d)
    throw std::invalid_argument("|.|_V is a norm of displacements, with " + std::to_string(d) + " components a node");
  const Eigen::VectorXd local = layout_.local(v);
  double total = 0;
  for (Eigen::Index c = 0; c < layout_.cells(); ++c) {
    const Simplex<d>& s = cells_[static_cast<std::size_t>(c)];
    Eigen::Matrix<double, d, d + 1> nodal;
    for (int i = 0; i <= d; ++i) nodal.col(i) = local.segment<d>(layout_.local_cells()(c, i) * d);
    const Tensor2<d> gradient = nodal * s.gradients;
    total += s.volume * 0.25 * (gradient + gradient.transpose()).squaredNorm();
  }
  return std::sqrt(layout_.sum(total));
}

template <int d>
StressSize stress_size(const Layout<d>& layout, const Problem<d>& problem, Vec u, Vec w, Vec theta) {
  const Eigen::VectorXd local_u = u ? layout.local(u) : Eigen::VectorXd(), local_w = w ? layout.local(w) : local_u,
                        local_theta = theta ? layout.local(theta) : Eigen::VectorXd();
  const auto size = [](const Eigen::VectorXd& v) { return v.size() ? v.cwiseAbs().maxCoeff() : 0.0; };
  const double size_u = size(local_u), size_w = w ? size(local_w) : 0;
  double found[] = {0, 0};
  for (Eigen::Index c = 0; c < layout.cells(); ++c) {
    const Index cell = layout.mesh_cells()[static_cast<std::size_t>(c)];
    const Material<d>& material = problem.material(cell);
    const StrainMatrix<d> b = strain_matrix<d>(simplex<d>(vertices(*problem.mesh, cell)));
    const auto strain = [&](const Eigen::VectorXd& local) -> Mandel<d> {
      Eigen::Matrix<double, d*(d + 1), 1> nodal;
      for (int i = 0; i <= d; ++i) nodal.template segment<d>(i * d) = local.segment<d>(layout.local_cells()(c, i) * d);
      return b * nodal;
    };
    Mandel<d> stress = Mandel<d>::Zero();
    double possible = 0;
    const auto add = [&](const auto& tensor, Vec v, const Eigen::VectorXd& local, double at_most) {
      if (!tensor || !v) return;
      stress += *tensor * strain(local);
      possible += tensor->norm() * b.norm() * at_most;
    };
    add(material.elasticity, u, local_u, size_u);
    add(material.viscosity, w, local_w, size_w);
    Tensor2<d> whole = from_mandel<d>(stress);
    if (theta && material.expansion) {
      double warmer = 0;
      for (int i = 0; i <= d; ++i) warmer += (local_theta[layout.local_cells()(c, i)] - material.reference) / (d + 1);
      whole -= warmer * *material.expansion;
    }
    found[0] = std::max(found[0], whole.norm());
    found[1] = std::max(found[1], possible);
  }
  MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_DOUBLE, MPI_MAX, layout.comm());
  return {found[0], found[1]};
}

#define WARMSLIP_INSTANTIATE(d)                                                           \
  template StressSize stress_size<d>(const Layout<d>&, const Problem<d>&, Vec, Vec, Vec); \
  template class LoadQuadrature<d>;                                                       \
  template class Norms<d>;
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
