#include "warmslip/fem/contact_surface.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "warmslip/mesh/quadrature.hpp"

namespace warmslip {
namespace {

template <int d>
std::set<Index> nodes_of(const Mesh<d>& mesh, const std::vector<std::string>& parts) {
  std::set<Index> nodes;
  for (const auto& name : parts) {
    const auto& facets = mesh.part(name);
    nodes.insert(facets.nodes.data(), facets.nodes.data() + facets.nodes.size());
  }
  return nodes;
}

// Whether rows of a matrix that are not zero depend on each other. A pivot of their products, relative to its diagonal,
// is the squared sine of the angle between a row and those eliminated before it. Eigen's SparseQR would do as well, but
// it writes to memory that it did not get (SparseMatrix::uncompress).
bool dependent(const Eigen::SparseMatrix<double, Eigen::RowMajor>& rows) {
  constexpr double nothing = 1e-10;
  const Eigen::VectorXd sizes = rows.cwiseProduct(rows) * Eigen::VectorXd::Ones(rows.cols());
  std::vector<Eigen::Triplet<double>> chosen;
  Eigen::Index some = 0;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    if (sizes[i] > 0) chosen.emplace_back(some++, i, 1 / std::sqrt(sizes[i]));
  if (some > rows.cols() || some == 0) return some > 0;
  Eigen::SparseMatrix<double> unit(some, rows.rows());
  unit.setFromTriplets(chosen.begin(), chosen.end());
  const Eigen::SparseMatrix<double> scaled = unit * Eigen::SparseMatrix<double>(rows);
  const Eigen::SparseMatrix<double> products = scaled * Eigen::SparseMatrix<double>(scaled.transpose());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> pivots(products);
  return pivots.info() != Eigen::Success || !(pivots.vectorD().minCoeff() > nothing);
}

}  // namespace

template <int d>
ContactSurface<d>::ContactSurface(const Layout<d>& layout, const Problem<d>& problem) : layout_(layout) {
  const Mesh<d>& mesh = layout.mesh();
  const std::map<Index, Tensor2<d>> supports = held_directions(problem);
  std::vector<std::string> touching;
  for (const ContactPart& contact : problem.contacts)
    if (contact.law) touching.push_back(contact.part);
  std::map<Index, Eigen::Index> number;
  for (const Index node : nodes_of(mesh, touching)) {
    number[node] = static_cast<Eigen::Index>(nodes_.size());
    nodes_.push_back(node);
    global_nodes_.push_back(layout_.global_of(node));
  }
  const auto held_at = [&](Index node) -> Tensor2<d> {
    const auto found = supports.find(node);
    return found == supports.end() ? Tensor2<d>(Tensor2<d>::Zero()) : found->second;
  };
  std::vector<bool> fixed;
  std::vector<Eigen::Triplet<double>> free;
  for (const Index node : nodes_) {
    const auto row = static_cast<int>(fixed.size()) * d;
    const Tensor2<d> left = Tensor2<d>::Identity() - held_at(node);
    fixed.push_back(left.isZero(0));
    for (int a = 0; a < d; ++a)
      for (int b = 0; b < d; ++b)
        if (left(a, b) != 0) free.emplace_back(row + a, row + b, left(a, b));
  }
  free_.resize(nodes() * d, nodes() * d);
  free_.setFromTriplets(free.begin(), free.end());

  std::vector<Point<d>> positions, normals;
  std::vector<double> weights;
  std::vector<Eigen::Triplet<double>> shape, scalar_shape;
  const auto add_shape = [&](std::size_t point, Index node, double value) {
    const int row = static_cast<int>(point), column = static_cast<int>(number.at(node));
    scalar_shape.emplace_back(row, column, value);
    for (int a = 0; a < d; ++a) shape.emplace_back(row * d + a, column * d + a, value);
  };
  for (std::size_t part = 0; part < problem.contacts.size(); ++part) {
    const ContactPart& contact = problem.contacts[part];
    if (!contact.law) continue;
    const auto new_point = [&](const Point<d>& x, const Point<d>& nu, double weight) {
      positions.push_back(x);
      normals.push_back(nu);
      weights.push_back(weight);
      contacts_.push_back(part);
      return weights.size() - 1;
    };
    const bool nodal = contact.quadrature.points == 0;
    const Rule rule = simplex_rule(d - 1, nodal ? 1 : contact.quadrature.points);
    std::map<Index, std::vector<std::size_t>> at_node;  // vertex rule: points that differ in normal only stay apart
    const Facets<d>& facets = mesh.part(contact.part);
    for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
      const Point<d> area = area_normal(mesh, facets, f), nu = area.normalized();
      if (nodal) {
        for (int i = 0; i < d; ++i) {
          const Index node = facets.nodes(f, i);
          auto& here = at_node[node];
          const auto same =
              std::find_if(here.begin(), here.end(), [&](std::size_t p) { return (normals[p] - nu).norm() < 1e-12; });
          if (same != here.end()) {
            weights[*same] += area.norm() / d;
          } else {
            here.push_back(new_point(mesh.nodes.row(node).transpose(), nu, area.norm() / d));
            add_shape(here.back(), node, 1);
          }
        }
      } else {
        for (Eigen::Index q = 0; q < rule.weights.size(); ++q) {
          Point<d> x = Point<d>::Zero();
          for (int i = 0; i < d; ++i) x += rule.barycentric(q, i) * mesh.nodes.row(facets.nodes(f, i)).transpose();
          const std::size_t point = new_point(x, nu, area.norm() * rule.weights[q]);
          for (int i = 0; i < d; ++i) add_shape(point, facets.nodes(f, i), rule.barycentric(q, i));
        }
      }
    }
  }
  const auto count = static_cast<Eigen::Index>(weights.size());
  weights_ = Eigen::Map<Eigen::VectorXd>(weights.data(), count);
  positions_.resize(count, d);
  normals_.resize(count, d);
  for (Eigen::Index i = 0; i < count; ++i) {
    positions_.row(i) = positions[static_cast<std::size_t>(i)].transpose();
    normals_.row(i) = normals[static_cast<std::size_t>(i)].transpose();
  }
  shape_.resize(count * d, nodes() * d);
  shape_.setFromTriplets(shape.begin(), shape.end());
  scalar_shape_.resize(count, nodes());
  scalar_shape_.setFromTriplets(scalar_shape.begin(), scalar_shape.end());
  moving_shape_ = (shape_ * free_).pruned();
  held_ = Eigen::MatrixXd::Zero(count * d, d);
  std::vector<Eigen::Triplet<double>> across;  // the directions in which each point is not held
  int directions = 0;
  for (Eigen::Index q = 0; q < count; ++q) {
    Tensor2<d> left = Tensor2<d>::Zero();  // a direction is held where all nodes about the point hold it
    prescribed_.push_back(true);
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(scalar_shape_, q); entry; ++entry) {
      if (!fixed[static_cast<std::size_t>(entry.col())]) prescribed_.back() = false;
      left += Tensor2<d>::Identity() - held_at(nodes_[static_cast<std::size_t>(entry.col())]);
    }
    if (prescribed(q)) continue;
    const Eigen::SelfAdjointEigenSolver<Tensor2<d>> frame(left);
    for (int a = 0; a < d; ++a) {
      const Point<d> direction = frame.eigenvectors().col(a);
      if (frame.eigenvalues()[a] < 1e-12) {
        held_.template middleRows<d>(q * d) += direction * direction.transpose();
      } else {
        for (int b = 0; b < d; ++b) across.emplace_back(directions, static_cast<int>(q) * d + b, direction[b]);
        ++directions;
      }
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> released(directions, count * d);
  released.setFromTriplets(across.begin(), across.end());
  shares_ = dependent(released * moving_shape_);

  std::vector<int> touched(static_cast<std::size_t>(nodes()), 0);  // points that a node moves
  for (const auto& entry : scalar_shape) ++touched[static_cast<std::size_t>(entry.col())];
  own_nodes_.assign(static_cast<std::size_t>(count), -1);
  for (const auto& entry : scalar_shape)
    if (entry.value() == 1 && touched[static_cast<std::size_t>(entry.col())] == 1 && !prescribed(entry.row()) &&
        (held_.template middleRows<d>(entry.row() * d) * normals_.row(entry.row()).transpose()).isZero(1e-14))
      own_nodes_[static_cast<std::size_t>(entry.row())] = entry.col();
}

template <int d>
void ContactSurface<d>::add(const Eigen::VectorXd& nodal, Vec v) const {
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(v, &begin, &end));
  Values owned(v);
  for (Eigen::Index i = 0; i < nodes(); ++i) {
    const Eigen::Index first = Eigen::Index{global_nodes_[static_cast<std::size_t>(i)]} * d - begin;
    if (first >= 0 && first < end - begin) (*owned).template segment<d>(first) += nodal.template segment<d>(i * d);
  }
}

template <int d>
std::vector<PetscInt> ContactSurface<d>::unknowns(int block) const {
  std::vector<PetscInt> indices;
  indices.reserve(nodes_.size() * d);
  for (const PetscInt node : global_nodes_)
    for (int a = 0; a < d; ++a) indices.push_back(node * block + a);
  return indices;
}

template <int d>
Eigen::VectorXd ContactSurface<d>::nodal_values(Vec v) const {
  if (nodes_.empty()) return {};
  const Eigen::Index block = block_size(v), count = block == 1 ? 1 : d;
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(v, &begin, &end));
  Eigen::VectorXd values = Eigen::VectorXd::Zero(nodes() * count);
  {
    Values owned(v);
    for (Eigen::Index i = 0; i < nodes(); ++i) {
      const Eigen::Index first = global_nodes_[static_cast<std::size_t>(i)] * block - begin;
      if (first >= 0 && first < end - begin) values.segment(i * count, count) = (*owned).segment(first, count);
    }
  }
  return layout_.sum(std::move(values));
}

template <int d>
Eigen::VectorXd ContactSurface<d>::at_points(const Eigen::VectorXd& nodal) const {
  return shape_ * nodal;
}

template <int d>
Eigen::VectorXd ContactSurface<d>::tangential(const Eigen::VectorXd& vectors) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(points() * d);
  for (Eigen::Index q = 0; q < points() && vectors.size() > 0; ++q) {
    const Point<d> nu = normals_.row(q).transpose(), here = vectors.segment<d>(q * d);
    out.segment<d>(q * d) = here - here.dot(nu) * nu;
  }
  return out;
}

template <int d>
Eigen::VectorXd ContactSurface<d>::nodal_mean(const Eigen::VectorXd& values) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(nodes()), weight = sum,
                  low = Eigen::VectorXd::Constant(nodes(), INFINITY), high = -low;
  for (Eigen::Index q = 0; q < scalar_shape_.outerSize(); ++q)
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(scalar_shape_, q); entry; ++entry) {
      const Eigen::Index node = entry.col();
      sum[node] += weights_[q] * entry.value() * values[q];
      weight[node] += weights_[q] * entry.value();
      low[node] = std::min(low[node], values[q]);
      high[node] = std::max(high[node], values[q]);
    }
  return sum.cwiseQuotient(weight).cwiseMax(low).cwiseMin(high);
}

template <int d>
Eigen::VectorXd ContactSurface<d>::to_nodes(const Eigen::VectorXd& forces) const {
  return free_ * (shape_.transpose() * forces);
}

template <int d>
Eigen::MatrixXd ContactSurface<d>::at_points(const Eigen::MatrixXd& compliance) const {
  constexpr double lent = 1e-11;  // a slip that it explains is rounding of the motion
  const Eigen::MatrixXd free = (free_ * compliance) * free_;
  const Eigen::MatrixXd half = shape_ * free;
  Eigen::MatrixXd out = half * shape_.transpose();
  for (Eigen::Index q = 0; q < points(); ++q)
    out.template block<d, d>(q * d, q * d) +=
        lent * out.template block<d, d>(q * d, q * d).trace() * held_.template middleRows<d>(q * d);
  return out;
}

template <int d>
ContactProblem<d> contact_problem(const Problem<d>& problem, const ContactSurface<d>& surface, double k,
                                  const Eigen::VectorXd& u, const Eigen::VectorXd& gap, Eigen::VectorXd free,
                                  Eigen::VectorXd rigid) {
  ContactProblem<d> out{{}, k, {}, std::move(free), std::move(rigid)};
  for (const ContactPart& part : problem.contacts) out.laws.push_back(part.law.value_or(ContactLaw{}));
  for (Eigen::Index i = 0; i < surface.points(); ++i) {
    const Point<d> nu = surface.normals().row(i).transpose(), here = u.segment<d>(i * d);
    out.points.push_back(
        {nu, surface.weights()[i], here.dot(nu) - gap[i], here, gap[i], surface.contact(i), surface.prescribed(i)});
  }
  return out;
}

template <int d>
ContactFlow contact_flow(const Problem<d>& problem, const ContactSurface<d>& surface, const Eigen::VectorXd& force,
                         const Eigen::VectorXd& w, const Eigen::VectorXd& free) {
  const double rest = free.size() ? 1e-12 * free.cwiseAbs().maxCoeff() : 0;
  ContactFlow flow{Eigen::VectorXd::Zero(surface.points()), Eigen::VectorXd::Zero(surface.points())};
  for (Eigen::Index i = 0; i < surface.points(); ++i) {
    const ContactPart& part = problem.contacts[surface.contact(i)];
    const Point<d> nu = surface.normals().row(i).transpose(), velocity = w.segment<d>(i * d);
    const Point<d> here = force.segment<d>(i * d), slip = velocity - velocity.dot(nu) * nu;
    const double weight = surface.weights()[i], pressure = std::max(here.dot(nu), 0.0) / weight;
    flow.conductance[i] = weight * part.heat.per_pressure * pressure;
    flow.friction[i] = slip.norm() > rest ? part.heat.share * here.dot(slip) : 0;
  }
  return flow;
}

#define WARMSLIP_INSTANTIATE(d)                                                                                  \
  template class ContactSurface<d>;                                                                              \
  template ContactProblem<d> contact_problem<d>(const Problem<d>&, const ContactSurface<d>&, double,             \
                                                const Eigen::VectorXd&, const Eigen::VectorXd&, Eigen::VectorXd, \
                                                Eigen::VectorXd);                                                \
  template ContactFlow contact_flow<d>(const Problem<d>&, const ContactSurface<d>&, const Eigen::VectorXd&,      \
                                       const Eigen::VectorXd&, const Eigen::VectorXd&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
