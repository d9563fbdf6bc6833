#include "warmslip/fem/operators.hpp"

#include <algorithm>
#include <set>

#include "warmslip/fem/supports.hpp"
#include "warmslip/physics/p1.hpp"

namespace warmslip {
namespace {

template <int rows, int cols>
using RowMajor = Eigen::Matrix<double, rows, cols, Eigen::RowMajor>;

// a = sum over the rank's cells of kernel(simplex, material), each block changed by `change`(cell, block)
template <int d, class Kernel, class Change = std::nullptr_t>
MatHandle assemble(const Layout<d>& layout, const Problem<d>& problem, int rows, int cols, Kernel&& kernel,
                   Change&& change = nullptr, MatType type = MATAIJ) {
  MatHandle a = layout.matrix(rows, cols, type);
  for (Eigen::Index c = 0; c < layout.cells(); ++c) {
    const Index cell = layout.mesh_cells()[static_cast<std::size_t>(c)];
    auto block = kernel(simplex<d>(vertices(layout.mesh(), cell)), problem.material(cell));
    if constexpr (requires { change(cell, block); }) change(cell, block);
    using Block = std::decay_t<decltype(block)>;
    const RowMajor<Block::RowsAtCompileTime, Block::ColsAtCompileTime> values = block;
    layout.add(a, c, values.data());
  }
  layout.assemble(a);
  return a;
}

template <class Tensor>
Tensor or_zero(const std::optional<Tensor>& tensor) {
  return tensor ? *tensor : Tensor(Tensor::Zero());
}

// rho M / k + B + k A on one cell
template <int d>
VectorBlock<d> momentum(const Simplex<d>& s, const Material<d>& m, double k) {
  VectorBlock<d> block = VectorBlock<d>::Zero();
  if (m.density > 0) block += m.density / k * warmslip::vector_mass<d>(s);
  if (m.elasticity || m.viscosity) block += strain_energy<d>(s, or_zero(m.viscosity) + k * or_zero(m.elasticity));
  return block;
}

// The mass of heat on a simplex or a facet of `nodes` vertices, as the problem wants it.
template <int nodes, int d>
Eigen::Matrix<double, nodes, nodes> heat_mass(const Problem<d>& problem, double measure) {
  return problem.lumped ? lumped_mass<nodes>(measure) : warmslip::mass<nodes>(measure);
}

// m(reference temperature, v): what a body at that temperature needs to be free of stress.
template <int d>
VecHandle reference_force(const Layout<d>& layout, const Problem<d>& problem) {
  VecHandle v = layout.vector(d);
  Vec form;
  WARMSLIP_PETSC(VecGhostGetLocalForm(v, &form));
  {
    Values entries(form);
    for (Eigen::Index c = 0; c < layout.cells(); ++c) {
      const Index cell = layout.mesh_cells()[static_cast<std::size_t>(c)];
      const Material<d>& m = problem.material(cell);
      if (!m.expansion || m.reference == 0) continue;
      const Eigen::Matrix<double, d*(d + 1), 1> force =
          m.reference * coupling<d>(simplex<d>(vertices(layout.mesh(), cell)), *m.expansion).rowwise().sum();
      for (int i = 0; i <= d; ++i)
        (*entries).template segment<d>(layout.local_cells()(c, i) * d) += force.template segment<d>(i * d);
    }
  }
  WARMSLIP_PETSC(VecGhostRestoreLocalForm(v, &form));
  WARMSLIP_PETSC(VecGhostUpdateBegin(v, ADD_VALUES, SCATTER_REVERSE));
  WARMSLIP_PETSC(VecGhostUpdateEnd(v, ADD_VALUES, SCATTER_REVERSE));
  return v;
}

// Adds factor * int k_c theta eta over the facets of Gamma_C, in component `component` of `block` unknowns a node.
template <int d>
void add_exchange(const Layout<d>& layout, const Problem<d>& problem, double factor, int block, int component, Mat a) {
  for (const ContactPart& contact : problem.contacts) {
    if (contact.conductance == 0) continue;
    const Facets<d>& facets = layout.mesh().part(contact.part);
    for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
      if (!layout.owns_cell(facets.cells[static_cast<std::size_t>(f)])) continue;
      const RowMajor<d, d> values =
          factor * contact.conductance * heat_mass<d>(problem, area_normal(layout.mesh(), facets, f).norm());
      std::array<PetscInt, d> unknowns;
      for (int i = 0; i < d; ++i)
        unknowns[static_cast<std::size_t>(i)] = layout.global_of(facets.nodes(f, i)) * block + component;
      WARMSLIP_PETSC(MatSetValues(a, d, unknowns.data(), d, unknowns.data(), values.data(), ADD_VALUES));
    }
  }
}

// Owned global nodes of `parts`.
template <int d>
std::vector<PetscInt> owned_nodes(const Layout<d>& layout, const std::vector<std::string>& parts) {
  std::set<Index> nodes;
  for (const auto& name : parts) {
    const auto& facets = layout.mesh().part(name);
    nodes.insert(facets.nodes.data(), facets.nodes.data() + facets.nodes.size());
  }
  std::vector<PetscInt> indices;
  for (const Index node : nodes)
    if (owns(layout, node)) indices.push_back(layout.global_of(node));
  return indices;
}

void fix(Mat a, const std::vector<PetscInt>& indices) {
  WARMSLIP_PETSC(MatZeroRowsColumns(a, static_cast<PetscInt>(indices.size()), indices.data(), 1.0, nullptr, nullptr));
}

}  // namespace

template <int d>
Operators<d>::Operators(const Layout<d>& layout, const Problem<d>& problem) {
  using M = Material<d>;
  using S = Simplex<d>;
  const auto has = [&](auto block) { return problem.has(block); };
  if (problem.inertial()) {
    const MatHandle scalar = assemble(layout, problem, 1, 1, [](const S& s, const M& m) {
      return (m.density * warmslip::mass<d + 1>(s.volume)).eval();
    });
    WARMSLIP_PETSC(MatCreateMAIJ(scalar, d, inertia.out()));
  }
  const auto sprung = [&](auto tensor) {
    return std::any_of(problem.springs.begin(), problem.springs.end(), [&](auto& s) { return (s.*tensor).present(); });
  };
  const bool on_springs = sprung(&PartSprings<d>::stiffness), on_dashpots = sprung(&PartSprings<d>::damping);
  // in blocks, each with one index: products take 0.7 times as long in the plane, and half in space
  const auto of_strain = [&](auto tensor) {
    return assemble(
        layout, problem, d, d, [tensor](const S& s, const M& m) { return strain_energy<d>(s, or_zero(m.*tensor)); },
        nullptr, MATBAIJ);
  };
  if (has(&M::elasticity) || on_springs) elasticity = of_strain(&M::elasticity);
  if (has(&M::viscosity) || on_dashpots) viscosity = of_strain(&M::viscosity);
  const auto add_to = [&](MatHandle& whole, MatHandle& part, double stiffness, double damping) {
    part = layout.matrix(d, d, MATBAIJ);
    add_springs(layout, problem, stiffness, damping, {}, d, part);
    layout.assemble(part);
    WARMSLIP_PETSC(MatAXPY(whole, 1, part, SUBSET_NONZERO_PATTERN));
  };
  if (on_springs) add_to(elasticity, springs, 1, 0);
  if (on_dashpots) add_to(viscosity, dashpots, 0, 1);
  if (problem.moves()) std::tie(prescribed_displacement, inclined) = held_unknowns(layout, problem);
  if (!problem.conducts()) return;
  mass = assemble(layout, problem, 1, 1,
                  [&](const S& s, const M& m) { return (m.capacity * heat_mass<d + 1>(problem, s.volume)).eval(); });
  conductivity =
      assemble(layout, problem, 1, 1, [](const S& s, const M& m) { return conduction<d>(s, or_zero(m.conductivity)); });
  if (has(&M::expansion))
    expansion =
        assemble(layout, problem, d, 1, [](const S& s, const M& m) { return coupling<d>(s, or_zero(m.expansion)); });
  std::set<double> references;
  for (const M& m : problem.materials)
    if (m.expansion) references.insert(m.reference);
  if (!references.empty() && references != std::set{0.0}) reference = reference_force(layout, problem);
  if (references.size() == 1) common_reference = *references.begin();
  if (has(&M::heating))
    heating = assemble(layout, problem, 1, d,
                       [](const S& s, const M& m) { return coupling<d>(s, or_zero(m.heating)).transpose().eval(); });
  if (std::any_of(problem.contacts.begin(), problem.contacts.end(), [](auto& c) { return c.conductance != 0; })) {
    exchange = layout.matrix(1, 1);
    add_exchange(layout, problem, 1, 1, 0, exchange);
    layout.assemble(exchange);
  }
  prescribed_temperature = owned_nodes(layout, problem.prescribed_temperature);
}

template <int d>
MatHandle momentum_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k) {
  const auto inclined = by_node(operators.inclined);
  MatHandle a = assemble(
      layout, problem, d, d, [k](const Simplex<d>& s, const Material<d>& m) { return momentum<d>(s, m, k); },
      [&](Index cell, auto& block) { release(layout, inclined, cell, d, block); });
  if (!problem.springs.empty()) {
    add_springs(layout, problem, k, 1, inclined, d, a);
    layout.assemble(a);
  }
  add_held(layout, operators.inclined, d, a);
  fix(a, operators.prescribed_displacement);
  return a;
}

template <int d>
MatHandle heat_matrix(const Operators<d>& operators, double k) {
  MatHandle a;
  WARMSLIP_PETSC(MatDuplicate(operators.mass, MAT_COPY_VALUES, a.out()));
  WARMSLIP_PETSC(MatScale(a, 1 / k));
  WARMSLIP_PETSC(MatAXPY(a, 1, operators.conductivity, SAME_NONZERO_PATTERN));
  if (operators.exchange) WARMSLIP_PETSC(MatAXPY(a, 1, operators.exchange, SUBSET_NONZERO_PATTERN));
  fix(a, operators.prescribed_temperature);
  return a;
}

template <int d>
MatHandle coupled_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k,
                         double scale) {
  constexpr int b = d + 1;
  const auto inclined = by_node(operators.inclined);
  const auto coupled = [&](const Simplex<d>& s, const Material<d>& m) {
    const VectorBlock<d> motion = momentum<d>(s, m, k);
    const MixedBlock<d> expansion = coupling<d>(s, or_zero(m.expansion)), heating = coupling<d>(s, or_zero(m.heating));
    const ScalarBlock<d> heat =
        m.capacity / k * heat_mass<d + 1>(problem, s.volume) + conduction<d>(s, or_zero(m.conductivity));
    Eigen::Matrix<double, b*(d + 1), b*(d + 1)> block;
    for (int i = 0; i <= d; ++i)
      for (int j = 0; j <= d; ++j) {
        block.template block<d, d>(i * b, j * b) = motion.template block<d, d>(i * d, j * d);
        block.template block<d, 1>(i * b, j * b + d) = -expansion.template block<d, 1>(i * d, j);
        block.template block<1, d>(i * b + d, j * b) = -scale * heating.template block<d, 1>(j * d, i).transpose();
        block(i * b + d, j * b + d) = scale * heat(i, j);
      }
    return block;
  };
  MatHandle a = assemble(layout, problem, b, b, coupled,
                         [&](Index cell, auto& block) { release(layout, inclined, cell, b, block); });
  add_exchange(layout, problem, scale, b, d, a);
  add_springs(layout, problem, k, 1, inclined, b, a);
  layout.assemble(a);
  add_held(layout, operators.inclined, b, a);
  std::vector<PetscInt> indices;
  for (const PetscInt i : operators.prescribed_displacement) indices.push_back(i / d * b + i % d);
  for (const PetscInt i : operators.prescribed_temperature) indices.push_back(i * b + d);
  fix(a, indices);
  return a;
}

// With R = c M the heat rows divided by c make the coupled matrix symmetric: definite for c > 0 unless the coupling is
// strong, quasi-definite for c < 0 (Vanderbei, SIAM J. Optim. 5, 1995). Of several materials all must have the same c.
template <int d>
std::pair<double, Symmetry> coupled_symmetry(const Problem<d>& problem) {
  double product = 0, expansion = 0;
  for (const Material<d>& m : problem.materials) {
    if (m.expansion) expansion += m.expansion->squaredNorm();
    if (m.expansion && m.heating) product += m.heating->cwiseProduct(*m.expansion).sum();
  }
  const double c = expansion > 0 ? product / expansion : 0;
  bool any = false;
  for (const Material<d>& m : problem.materials) {
    const Tensor2<d> heating = m.heating.value_or(Tensor2<d>::Zero()),
                     stress = m.expansion.value_or(Tensor2<d>::Zero());
    any = any || !heating.isZero(0) || !stress.isZero(0);
    if ((heating - c * stress).norm() > 1e-14 * heating.norm()) return {1, Symmetry::general};
  }
  if (!any) return {1, problem.conducts_symmetrically() ? Symmetry::positive_definite : Symmetry::general};
  if (c == 0 || !problem.conducts_symmetrically()) return {1, Symmetry::general};
  return {1 / c, c > 0 ? Symmetry::definite_or_refused : Symmetry::symmetric};
}

#define WARMSLIP_INSTANTIATE(d)                                                                                   \
  template struct Operators<d>;                                                                                   \
  template MatHandle momentum_matrix<d>(const Layout<d>&, const Problem<d>&, const Operators<d>&, double);        \
  template MatHandle heat_matrix<d>(const Operators<d>&, double);                                                 \
  template MatHandle coupled_matrix<d>(const Layout<d>&, const Problem<d>&, const Operators<d>&, double, double); \
  template std::pair<double, Symmetry> coupled_symmetry<d>(const Problem<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
