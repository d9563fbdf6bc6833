#include "warmslip/operators.hpp"

#include <set>

#include "warmslip/element.hpp"

namespace warmslip {
namespace {

template <int rows, int cols>
using RowMajor = Eigen::Matrix<double, rows, cols, Eigen::RowMajor>;

// a = sum over the rank's cells of kernel(simplex)
template <int d, class Kernel>
MatHandle assemble(const Layout<d>& layout, int rows, int cols, Kernel&& kernel) {
  MatHandle a = layout.matrix(rows, cols);
  for (Eigen::Index c = 0; c < layout.cells(); ++c) {
    const auto block = kernel(simplex<d>(vertices(layout.mesh(), layout.mesh_cells()[static_cast<std::size_t>(c)])));
    using Block = std::decay_t<decltype(block)>;
    const RowMajor<Block::RowsAtCompileTime, Block::ColsAtCompileTime> values = block;
    layout.add(a, c, values.data());
  }
  layout.assemble(a);
  return a;
}

// int k_c theta eta over the facets of Gamma_C
template <int d>
MatHandle exchange_matrix(const Layout<d>& layout, const Problem<d>& problem) {
  MatHandle a = layout.matrix(1, 1);
  const Facets<d>& facets = layout.mesh().part(problem.contact_part);
  for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
    if (!layout.owns_cell(facets.cells[static_cast<std::size_t>(f)])) continue;
    const RowMajor<d, d> block = problem.conductance * mass<d>(area_normal(layout.mesh(), facets, f).norm());
    std::array<PetscInt, d> nodes;
    for (int i = 0; i < d; ++i) nodes[static_cast<std::size_t>(i)] = layout.global_of(facets.nodes(f, i));
    WARMSLIP_PETSC(MatSetValuesBlocked(a, d, nodes.data(), d, nodes.data(), block.data(), ADD_VALUES));
  }
  layout.assemble(a);
  return a;
}

// Owned global scalar indices of the nodes of `parts`, `block` unknowns a node.
template <int d>
std::vector<PetscInt> fixed(const Layout<d>& layout, const std::vector<std::string>& parts, int block) {
  std::set<Index> nodes;
  for (const auto& name : parts) {
    const auto& facets = layout.mesh().part(name);
    nodes.insert(facets.nodes.data(), facets.nodes.data() + facets.nodes.size());
  }
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  std::vector<PetscInt> indices;
  for (const Index node : nodes) {
    const PetscInt global = layout.global_of(node);
    if (global < first || global >= first + layout.owned()) continue;
    for (int a = 0; a < block; ++a) indices.push_back(global * block + a);
  }
  return indices;
}

void fix(Mat a, const std::vector<PetscInt>& indices) {
  WARMSLIP_PETSC(MatZeroRowsColumns(a, static_cast<PetscInt>(indices.size()), indices.data(), 1.0, nullptr, nullptr));
}

}  // namespace

template <int d>
Operators<d>::Operators(const Layout<d>& layout, const Problem<d>& problem) {
  const Material<d>& m = problem.material;
  mass = assemble(layout, 1, 1, [](const Simplex<d>& s) { return warmslip::mass<d + 1>(s.volume); });
  WARMSLIP_PETSC(MatCreateMAIJ(mass, d, vector_mass.out()));
  elasticity = assemble(layout, d, d, [&](const Simplex<d>& s) { return strain_energy<d>(s, m.elasticity); });
  viscosity = assemble(layout, d, d, [&](const Simplex<d>& s) { return strain_energy<d>(s, m.viscosity); });
  conductivity = assemble(layout, 1, 1, [&](const Simplex<d>& s) { return conduction<d>(s, m.conductivity); });
  expansion = assemble(layout, d, 1, [&](const Simplex<d>& s) { return coupling<d>(s, m.expansion); });
  heating = assemble(layout, 1, d, [&](const Simplex<d>& s) { return coupling<d>(s, m.heating).transpose().eval(); });
  exchange = exchange_matrix(layout, problem);
  clamped = fixed(layout, problem.clamped, d);
  cooled = fixed(layout, problem.cooled, 1);
}

template <int d>
MatHandle momentum_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k) {
  const Material<d>& m = problem.material;
  MatHandle a = assemble(layout, d, d, [&](const Simplex<d>& s) -> VectorBlock<d> {
    return (m.density / k * warmslip::vector_mass<d>(s) + strain_energy<d>(s, m.viscosity + k * m.elasticity)).eval();
  });
  fix(a, operators.clamped);
  return a;
}

template <int d>
MatHandle heat_matrix(const Operators<d>& operators, double k) {
  MatHandle a;
  WARMSLIP_PETSC(MatDuplicate(operators.mass, MAT_COPY_VALUES, a.out()));
  WARMSLIP_PETSC(MatScale(a, 1 / k));
  WARMSLIP_PETSC(MatAXPY(a, 1, operators.conductivity, SAME_NONZERO_PATTERN));
  WARMSLIP_PETSC(MatAXPY(a, 1, operators.exchange, SUBSET_NONZERO_PATTERN));
  fix(a, operators.cooled);
  return a;
}

template <int d>
MatHandle coupled_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k,
                         double scale) {
  const Material<d>& m = problem.material;
  constexpr int b = d + 1;
  MatHandle a = assemble(layout, b, b, [&](const Simplex<d>& s) {
    const VectorBlock<d> momentum =
        (m.density / k * warmslip::vector_mass<d>(s) + strain_energy<d>(s, m.viscosity + k * m.elasticity)).eval();
    const MixedBlock<d> expansion = coupling<d>(s, m.expansion), heating = coupling<d>(s, m.heating);
    const ScalarBlock<d> heat = mass<d + 1>(s.volume) / k + conduction<d>(s, m.conductivity);
    Eigen::Matrix<double, b*(d + 1), b*(d + 1)> block;
    for (int i = 0; i <= d; ++i)
      for (int j = 0; j <= d; ++j) {
        block.template block<d, d>(i * b, j * b) = momentum.template block<d, d>(i * d, j * d);
        block.template block<d, 1>(i * b, j * b + d) = -expansion.template block<d, 1>(i * d, j);
        block.template block<1, d>(i * b + d, j * b) = -scale * heating.template block<d, 1>(j * d, i).transpose();
        block(i * b + d, j * b + d) = scale * heat(i, j);
      }
    return block;
  });
  const Facets<d>& facets = layout.mesh().part(problem.contact_part);
  for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
    if (!layout.owns_cell(facets.cells[static_cast<std::size_t>(f)])) continue;
    const RowMajor<d, d> exchange = scale * problem.conductance * mass<d>(area_normal(layout.mesh(), facets, f).norm());
    std::array<PetscInt, d> unknowns;
    for (int i = 0; i < d; ++i) unknowns[static_cast<std::size_t>(i)] = layout.global_of(facets.nodes(f, i)) * b + d;
    WARMSLIP_PETSC(MatSetValues(a, d, unknowns.data(), d, unknowns.data(), exchange.data(), ADD_VALUES));
  }
  layout.assemble(a);
  std::vector<PetscInt> indices;
  for (const PetscInt i : operators.clamped) indices.push_back(i / d * b + i % d);
  for (const PetscInt i : operators.cooled) indices.push_back(i * b + d);
  fix(a, indices);
  return a;
}

#define WARMSLIP_INSTANTIATE(d)                                                                            \
  template struct Operators<d>;                                                                            \
  template MatHandle momentum_matrix<d>(const Layout<d>&, const Problem<d>&, const Operators<d>&, double); \
  template MatHandle heat_matrix<d>(const Operators<d>&, double);                                          \
  template MatHandle coupled_matrix<d>(const Layout<d>&, const Problem<d>&, const Operators<d>&, double, double);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
