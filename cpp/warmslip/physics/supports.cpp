#include "warmslip/physics/supports.hpp"

#include <limits>

#include "warmslip/physics/problem.hpp"

namespace warmslip {
namespace {

// The directions in which a symmetric tensor resists, as rows, zero for the others: a weak one beside a strong one
// counts as much, down to the rounding of the tensor's entries, of which a diagonal one has none.
template <int d>
Tensor2<d> principal(const Tensor2<d>& tensor) {
  const Tensor2<d> diagonal = tensor.diagonal().asDiagonal();
  if (tensor == diagonal) return diagonal.unaryExpr([](double one) { return one > 0 ? 1.0 : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Tensor2<d>> found(tensor);
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * found.eigenvalues().cwiseAbs().maxCoeff();
  Tensor2<d> out = found.eigenvectors().transpose();
  for (int i = 0; i < d; ++i)
    if (found.eigenvalues()[i] <= rounding) out.row(i).setZero();
  return out;
}

}  // namespace

template <int d>
std::map<Index, Tensor2<d>> held_directions(const Problem<d>& problem) {
  std::map<Index, Tensor2<d>> held;
  for (const HeldNode<d>& node : problem.held_nodes) held[node.node] = node.held;
  for (const std::string& name : problem.prescribed_displacement)
    for (const Index node : problem.mesh->part(name).nodes.reshaped()) held[node] = Tensor2<d>::Identity();
  return held;
}

template <int d>
ResistedDirections<d> resisted_directions(const Problem<d>& problem, bool on_springs) {
  ResistedDirections<d> out;
  const auto add = [&](Index node, const Tensor2<d>& directions) {
    for (int a = 0; a < d; ++a)
      if (!directions.row(a).isZero(0)) {
        out.nodes.push_back(node);
        out.rows.push_back(directions.row(a).transpose());
      }
  };
  for (const auto& [node, directions] : held_directions(problem)) add(node, directions);
  if (!on_springs) return out;
  for (const PartSprings<d>& springs : problem.springs) {
    const Facets<d>& facets = problem.mesh->part(springs.part);
    for (Eigen::Index f = 0; f < facets.nodes.rows(); ++f) {
      const Point<d> nu = area_normal(*problem.mesh, facets, f).normalized();
      for (const Tensor2<d>& tensor : {springs.stiffness.on(nu), springs.damping.on(nu)}) {  // of units of their own
        const Tensor2<d> directions = principal<d>(tensor);
        for (int i = 0; i < d; ++i) add(facets.nodes(f, i), directions);
      }
    }
  }
  return out;
}

template std::map<Index, Tensor2<2>> held_directions(const Problem<2>&);
template std::map<Index, Tensor2<3>> held_directions(const Problem<3>&);
template ResistedDirections<2> resisted_directions(const Problem<2>&, bool);
template ResistedDirections<3> resisted_directions(const Problem<3>&, bool);

}  // namespace warmslip
