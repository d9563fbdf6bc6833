// Gamma_C in a discretised body: where the contact law is evaluated, with which weights, and how forces reach the
// nodes.
#pragma once
#include <Eigen/Sparse>

#include "warmslip/contact/solver.hpp"
#include "warmslip/fem/layout.hpp"
#include "warmslip/physics/problem.hpp"

namespace warmslip {

/// The points of all contact parts with a law, the same on every rank: contact nodes are few. Nodes whose displacement
/// is prescribed belong to them: they carry their motion to the points beside them, and bear their share of the force.
template <int d>
class ContactSurface {
 public:
  ContactSurface(const Layout<d>& layout, const Problem<d>& problem);

  Eigen::Index points() const { return weights_.size(); }
  Eigen::Index nodes() const { return static_cast<Eigen::Index>(nodes_.size()); }
  const RealTable<d>& positions() const { return positions_; }  ///< (points, d)
  const RealTable<d>& normals() const { return normals_; }      ///< (points, d), outward
  const Eigen::VectorXd& weights() const { return weights_; }   ///< (points), area
  /// Which of the problem's contact parts a point lies on.
  std::size_t contact(Eigen::Index point) const { return contacts_[static_cast<std::size_t>(point)]; }

  /// Whether the displacement of all nodes about a point is prescribed.
  bool prescribed(Eigen::Index point) const { return prescribed_[static_cast<std::size_t>(point)]; }

  /// Nodal values, (d nodes), without the directions that supports hold.
  Eigen::VectorXd released(const Eigen::VectorXd& nodal) const { return free_ * nodal; }

  /// The part of a force at a point along tangents that supports hold: it moves nothing.
  Point<d> held_along(Eigen::Index point, const Point<d>& force) const {
    const Tensor2<d> held = held_.template middleRows<d>(point * d);
    const bool across = (held * normals_.row(point).transpose()).norm() > 1e-12;
    return across ? Point<d>(Point<d>::Zero()) : Point<d>(held * force);
  }

  /// The node whose velocity is that of a point and of no other, and is not held across it; -1 where there is none.
  Eigen::Index own_node(Eigen::Index point) const { return own_nodes_[static_cast<std::size_t>(point)]; }
  /// Adds nodal values, (d nodes), to a displacement-like vector.
  void add(const Eigen::VectorXd& nodal, Vec v) const;

  /// Global scalar indices of the contact unknowns in a vector of `block` unknowns a node, displacement first: (d
  /// nodes).
  std::vector<PetscInt> unknowns(int block) const;
  /// Global numbers of the contact nodes, (nodes).
  const std::vector<PetscInt>& global_nodes() const { return global_nodes_; }
  /// Values of the contact nodes on every rank: (d nodes) of a displacement-like vector, (nodes) of a temperature.
  Eigen::VectorXd nodal_values(Vec v) const;
  const std::vector<Index>& mesh_nodes() const { return nodes_; }  ///< the contact nodes in the mesh's numbering
  /// Values at the contact points, (d points), of nodal ones, (d nodes).
  Eigen::VectorXd at_points(const Eigen::VectorXd& nodal) const;
  /// The tangential parts of vectors at the points, (d points); zeros for none.
  Eigen::VectorXd tangential(const Eigen::VectorXd& vectors) const;
  /// Means over the points about every node, (nodes), of values at the points, (points); no more and no less than
  /// these.
  Eigen::VectorXd nodal_mean(const Eigen::VectorXd& values) const;
  /// Forces at the points as nodal forces, without those that a support takes, (d nodes).
  Eigen::VectorXd to_nodes(const Eigen::VectorXd& forces) const;
  /// Compliance of the points from that of the nodes; a node whose displacement is prescribed has none. In directions
  /// in which supports hold a point and leave others free, it gets 1e-11 of the compliance that it has in the latter,
  /// so that the law has one answer there: without a motion, no force along them.
  Eigen::MatrixXd at_points(const Eigen::MatrixXd& compliance) const;
  /// The same for scalars, one value a node and a point: (points, nodes).
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& scalar_shape() const { return scalar_shape_; }
  /// Displacements of the points from nodal ones, (d points, d nodes), without what supports hold: forces on that move
  /// nothing.
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& moving_shape() const { return moving_shape_; }
  /// Whether forces of the points that move can be shared so that they move nothing.
  bool shares() const { return shares_; }

 private:
  const Layout<d>& layout_;
  std::vector<Index> nodes_;
  std::vector<PetscInt> global_nodes_;
  std::vector<std::size_t> contacts_;
  std::vector<bool> prescribed_;
  std::vector<Eigen::Index> own_nodes_;
  bool shares_ = false;
  Eigen::SparseMatrix<double, Eigen::RowMajor> free_;  // (d nodes, d nodes), projects onto directions that are not held
  Eigen::MatrixXd held_;  // (d points, d), projectors onto the directions in which a point is held and others are free
  Eigen::SparseMatrix<double, Eigen::RowMajor> scalar_shape_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape_, moving_shape_;  // (d points, d nodes)
  RealTable<d> positions_, normals_;
  Eigen::VectorXd weights_;
};

/// The contact problem of one step of size k from the displacement `u` at its start (d points) with the gap of its end
/// (points); `free` and `rigid` as there.
template <int d>
ContactProblem<d> contact_problem(const Problem<d>& problem, const ContactSurface<d>& surface, double k,
                                  const Eigen::VectorXd& u, const Eigen::VectorXd& gap, Eigen::VectorXd free,
                                  Eigen::VectorXd rigid = {});

/// What the contact itself does to the heat at every contact point, see ContactHeat.
struct ContactFlow {
  Eigen::VectorXd conductance;  ///< omega per_pressure p_nu
  Eigen::VectorXd friction;     ///< share of the frictional power, into the body
};
/// From the forces at the points and their velocities, (d points); a slip that is rounding of the velocities `free`
/// without contact makes no heat.
template <int d>
ContactFlow contact_flow(const Problem<d>& problem, const ContactSurface<d>& surface, const Eigen::VectorXd& force,
                         const Eigen::VectorXd& w, const Eigen::VectorXd& free);

}  // namespace warmslip
