// What holds a body: nodes whose displacement is given in all directions or in some, and parts on springs.
#pragma once
#include <map>
#include <string>

#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

template <int d>
struct Problem;

/// A node that is held in some directions: a roller, a guide, a support normal to an inclined part.
template <int d>
struct HeldNode {
  Index node;
  Tensor2<d> held;  ///< orthogonal projector onto the directions in which the displacement is given
};

/// Springs and dashpots on a part: the traction -(stiffness u + damping w) with tensors diag(axes) + normal nu nu^T on
/// every facet; all entries >= 0. Stiffness per area: stress per length; damping: stress per velocity.
template <int d>
struct PartSprings {
  struct Tensor {
    Point<d> axes = Point<d>::Zero();
    double normal = 0;

    bool present() const { return normal > 0 || !axes.isZero(0); }
    Tensor2<d> on(const Point<d>& nu) const {
      return Tensor2<d>(axes.asDiagonal()) + normal * Tensor2<d>(nu * nu.transpose());
    }
  };
  std::string part;
  Tensor stiffness, damping;
};

/// The projectors of all nodes that are held, by node: the identity on parts with a given displacement.
template <int d>
std::map<Index, Tensor2<d>> held_directions(const Problem<d>& problem);

/// One row for every held node and, `on_springs`, for every node of a facet on springs or dashpots, (rows, d), and the
/// nodes of the rows: a rigid motion is resisted unless all products of these rows with its nodal values vanish.
template <int d>
struct ResistedDirections {
  std::vector<Index> nodes;
  std::vector<Point<d>> rows;
};
template <int d>
ResistedDirections<d> resisted_directions(const Problem<d>& problem, bool on_springs);

}  // namespace warmslip
