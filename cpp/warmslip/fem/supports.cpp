#include "warmslip/fem/supports.hpp"

#include "warmslip/physics/p1.hpp"

namespace warmslip {
namespace {

template <int rows, int cols>
using RowMajor = Eigen::Matrix<double, rows, cols, Eigen::RowMajor>;

}  // namespace

template <int d>
std::pair<std::vector<PetscInt>, std::vector<HeldNode<d>>> held_unknowns(const Layout<d>& layout,
                                                                         const Problem<d>& problem) {
  std::pair<std::vector<PetscInt>, std::vector<HeldNode<d>>> out;
  for (const auto& [node, held] : held_directions(problem)) {
    Tensor2<d> askew = held;
    for (int a = 0; a < d; ++a) {
      if (held.row(a) != Tensor2<d>::Identity().row(a)) continue;  // nearly an axis is askew
      if (owns(layout, node)) out.first.push_back(layout.global_of(node) * d + a);
      askew.row(a).setZero();
      askew.col(a).setZero();
    }
    if (!askew.isZero(0)) out.second.push_back({node, askew});
  }
  return out;
}

template <int d>
void add_springs(const Layout<d>& layout, const Problem<d>& problem, double stiffness, double damping,
                 const Projectors<d>& inclined, int width, Mat a) {
  for (const PartSprings<d>& springs : problem.springs) {
    const Facets<d>& facets = layout.mesh().part(springs.part);
    for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
      if (!layout.owns_cell(facets.cells[static_cast<std::size_t>(f)])) continue;
      const Point<d> area = area_normal(layout.mesh(), facets, f), nu = area.normalized();
      const Tensor2<d> tensor = stiffness * springs.stiffness.on(nu) + damping * springs.damping.on(nu);
      const Eigen::Matrix<double, d, d> mass = warmslip::mass<d>(area.norm());
      RowMajor<d * d, d * d> values;
      std::array<PetscInt, static_cast<std::size_t>(d * d)> unknowns;
      std::array<Tensor2<d>, static_cast<std::size_t>(d)> free;
      for (int i = 0; i < d; ++i) {
        const auto found = inclined.find(facets.nodes(f, i));
        free[static_cast<std::size_t>(i)] = Tensor2<d>::Identity();
        if (found != inclined.end()) free[static_cast<std::size_t>(i)] -= found->second;
        for (int c = 0; c < d; ++c)
          unknowns[static_cast<std::size_t>(i * d + c)] = layout.global_of(facets.nodes(f, i)) * width + c;
      }
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j)
          values.template block<d, d>(i * d, j * d) =
              mass(i, j) * free[static_cast<std::size_t>(i)] * tensor * free[static_cast<std::size_t>(j)];
      WARMSLIP_PETSC(MatSetValues(a, d * d, unknowns.data(), d * d, unknowns.data(), values.data(), ADD_VALUES));
    }
  }
}

template <int d>
void add_held(const Layout<d>& layout, const std::vector<HeldNode<d>>& inclined, int width, Mat a) {
  if (inclined.empty()) return;
  VecHandle diagonal;
  WARMSLIP_PETSC(MatCreateVecs(a, diagonal.out(), nullptr));
  WARMSLIP_PETSC(MatGetDiagonal(a, diagonal));
  {
    Values entries(diagonal);
    for (const HeldNode<d>& one : inclined) {
      if (!owns(layout, one.node)) continue;
      const PetscInt first = (layout.global_of(one.node) - layout.global_nodes()[0]) * width;
      const double scale = (*entries).template segment<d>(first).maxCoeff();
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j)
          WARMSLIP_PETSC(MatSetValue(a, layout.global_of(one.node) * width + i, layout.global_of(one.node) * width + j,
                                     scale * one.held(i, j), ADD_VALUES));
    }
  }
  layout.assemble(a);
}

template <int d>
Eigen::VectorXd support_scales(const Layout<d>& layout, const std::vector<HeldNode<d>>& inclined, Mat a, int width) {
  Eigen::VectorXd scales = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(inclined.size()));
  for (Eigen::Index i = 0; i < scales.size(); ++i) {
    const HeldNode<d>& one = inclined[static_cast<std::size_t>(i)];
    if (!owns(layout, one.node)) continue;
    std::array<PetscInt, d> unknowns;
    for (int c = 0; c < d; ++c) unknowns[static_cast<std::size_t>(c)] = layout.global_of(one.node) * width + c;
    RowMajor<d, d> block;
    WARMSLIP_PETSC(MatGetValues(a, d, unknowns.data(), d, unknowns.data(), block.data()));
    scales[i] = (one.held * block).trace() / one.held.trace();
  }
  return scales.size() ? layout.sum(std::move(scales)) : scales;
}

template <int d>
void release(const Layout<d>& layout, const std::vector<PetscInt>& prescribed, const std::vector<HeldNode<d>>& inclined,
             Vec v) {
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  Values values(v);
  for (const PetscInt i : prescribed) (*values)[i - first * d] = 0;
  for (const HeldNode<d>& one : inclined) {
    if (!owns(layout, one.node)) continue;
    auto here = (*values).template segment<d>((layout.global_of(one.node) - first) * d);
    here -= (one.held * here).eval();
  }
}

#define WARMSLIP_INSTANTIATE(d)                                                                                      \
  template std::pair<std::vector<PetscInt>, std::vector<HeldNode<d>>> held_unknowns<d>(const Layout<d>&,             \
                                                                                       const Problem<d>&);           \
  template void add_springs<d>(const Layout<d>&, const Problem<d>&, double, double, const Projectors<d>&, int, Mat); \
  template void add_held<d>(const Layout<d>&, const std::vector<HeldNode<d>>&, int, Mat);                            \
  template Eigen::VectorXd support_scales<d>(const Layout<d>&, const std::vector<HeldNode<d>>&, Mat, int);           \
  template void release<d>(const Layout<d>&, const std::vector<PetscInt>&, const std::vector<HeldNode<d>>&, Vec);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
