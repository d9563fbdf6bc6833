// Supports and springs in the operator of the motion.
#pragma once
#include "warmslip/fem/layout.hpp"
#include "warmslip/physics/problem.hpp"

namespace warmslip {

/// Whether this rank owns a node.
template <int d>
bool owns(const Layout<d>& layout, Index node) {
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0, global = layout.global_of(node);
  return global >= first && global < first + layout.owned();
}

/// The held directions of the nodes by component, as scalar indices that this rank owns, and those that lie askew to
/// the axes, on every rank.
template <int d>
std::pair<std::vector<PetscInt>, std::vector<HeldNode<d>>> held_unknowns(const Layout<d>& layout,
                                                                         const Problem<d>& problem);

/// Projectors by node.
template <int d>
using Projectors = std::map<Index, Tensor2<d>>;
template <int d>
Projectors<d> by_node(const std::vector<HeldNode<d>>& nodes) {
  Projectors<d> out;
  for (const HeldNode<d>& one : nodes) out[one.node] = one.held;
  return out;
}

/// Takes the held directions of inclined nodes out of the rows and columns of the momentum's block of a cell, with
/// `width` unknowns a node.
template <int d, class Block>
void release(const Layout<d>& layout, const Projectors<d>& inclined, Index cell, int width, Block& block) {
  for (int i = 0; i <= d; ++i) {
    const auto found = inclined.find(layout.mesh().cells(cell, i));
    if (found == inclined.end()) continue;
    const Tensor2<d> free = Tensor2<d>::Identity() - found->second;
    block.template middleRows<d>(i * width) = (free * block.template middleRows<d>(i * width)).eval();
    block.template middleCols<d>(i * width) = (block.template middleCols<d>(i * width) * free).eval();
  }
}

/// Adds int v . (stiffness S + damping D) w over the parts on springs and dashpots to a matrix with `width` unknowns a
/// node, without the held directions of inclined nodes; to be assembled.
template <int d>
void add_springs(const Layout<d>& layout, const Problem<d>& problem, double stiffness, double damping,
                 const Projectors<d>& inclined, int width, Mat a);

/// Adds s P at the inclined nodes of an assembled matrix, and assembles it; s is the largest diagonal entry of the
/// node.
template <int d>
void add_held(const Layout<d>& layout, const std::vector<HeldNode<d>>& inclined, int width, Mat a);

/// The factors s of the inclined nodes in a matrix with `width` unknowns a node (collective).
template <int d>
Eigen::VectorXd support_scales(const Layout<d>& layout, const std::vector<HeldNode<d>>& inclined, Mat a, int width);

/// Takes the held directions, those of held_unknowns, out of a vector with d unknowns a node.
template <int d>
void release(const Layout<d>& layout, const std::vector<PetscInt>& prescribed, const std::vector<HeldNode<d>>& inclined,
             Vec v);

}  // namespace warmslip
