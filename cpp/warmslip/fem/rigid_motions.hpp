// Motions that the inner forces of a body do not resist, solved for apart from its deformation.
//
// Elasticity and viscosity vanish on rigid motions of a body without supports, and conduction on a constant
// temperature of an insulated one. In K = M' + (inner part), only the mass M' holds these motions. In long steps M' is
// so small beside the inner part that rounding of the latter swamps it. Exactly one thing is known about them: the
// inner part drops out of their equations. So with Z the motions, b = b_ext + b_in the right-hand side and b_in its
// inner part (Z^T b_in = 0),
//
//     K x = b - E lambda   <=>   x = K~^-1 (b - E lambda) + W a,   H a + W_c^T lambda = Z^T b_ext - V^T b
//
// where K~ = K + P has as many springs P as there are motions and is as well conditioned as a supported body,
// V = K~^-1 M' Z, W = Z - V = K~^-1 P Z, H = Z^T M' W and W_c = E^T W. No term of the equations for a is a difference
// of large numbers. This is the deflation of floating subdomains of FETI (Farhat & Roux, Int. J. Numer. Meth. Engng 32,
// 1991), with the mass kept.
//
// Springs on parts of the body that alone hold these motions belong to M', as does their force so far to b_ext.
//
// The coupled operator of displacement and temperature has the same inner part in this sense: thermal stresses do no
// work in a rigid motion, and a rigid motion makes no heat. Where the operator is not symmetric, V and W_c of the
// second equation belong to its transpose. K is positive definite if and only if K~ and H are, because
// H = Z^T P (P^-1 - K~^-1) P Z on the springs.
//
// In steps so short that waves cross only a part of the body, a spring is not felt beyond it: there, V is all but Z,
// and K~^-1 b and V a cancel. The mass then holds the motions well, and K is solved with as it is.
#pragma once
#include <functional>
#include <vector>

#include "warmslip/fem/contact_surface.hpp"
#include "warmslip/fem/layout.hpp"
#include "warmslip/la/factor.hpp"

namespace warmslip {

class RigidMotions {
 public:
  using Apply = std::function<void(Vec, Vec)>;

  /// Linear forms of the values of single nodes: `rows` (block) at the node of the same number.
  struct Resisted {
    std::vector<Index> nodes;
    std::vector<Eigen::VectorXd> rows;
  };

  RigidMotions() = default;
  /// Rigid motions (block d) or constants (block 1) of the parts of the mesh that hang together, those of them that
  /// nothing resists: the products of the rows of `resisted` with their values vanish. Displacement by x - centre over
  /// the size of the part, dimensionless. The operator has `width` unknowns a node, those of the motion first. `avoid`:
  /// nodes that get no spring where others will do; `firmness` (nodes of the mesh): how much the inner forces resist a
  /// relative motion there, in any unit.
  template <int d>
  RigidMotions(const Layout<d>& layout, int block, int width, const Resisted& resisted,
               const std::vector<std::string>& avoid, const Eigen::VectorXd& firmness);

  bool empty() const { return motions_.empty(); }
  bool apart() const { return !inner_.empty(); }  ///< whether the motions are solved for apart
  Eigen::Index count() const { return static_cast<Eigen::Index>(motions_.size()); }
  /// K -> K~.
  void add_springs(Mat k);
  /// V, W and H for a factored K~ and the mass M', which acts on vectors of the motion's unknowns.
  void prepare(Factor& factor, const Apply& mass);
  /// H = Z^T M' Z alone, of motions that the operator holds.
  void prepare(const Apply& mass);

  /// Z^T b_ext - V^T b (collective); b_ext has the motion's unknowns alone.
  Eigen::VectorXd load(Vec external, Vec all) const;
  /// Whether no motion has less than no inertia: H has no negative eigenvalue.
  bool holds() const;
  /// The motions a without contact. Throws SolveFailed when there is no mass to hold them.
  Eigen::VectorXd alone(const Eigen::VectorXd& load) const;
  /// inner -= V a: of the solution K~^-1 (b - E lambda), the part that strains. `carry` adds Z a.
  void strain(const Eigen::VectorXd& motions, Vec inner) const;
  /// x -= the motion that is nearest to it, in the sum of squares over the nodes; its components.
  Eigen::VectorXd remove(Vec x) const;
  /// Whether a vector is one of the motions, to nine digits (collective); x is overwritten.
  bool contains(Vec x) const;
  /// Z^T b (collective)
  Eigen::VectorXd of(Vec b) const { return dots(motions_, b); }
  /// x += Z a
  void carry(const Eigen::VectorXd& motions, Vec x) const;

  const Eigen::MatrixXd& inertia() const { return inertia_; }  ///< H
  double share() const { return share_; }  ///< the largest entry of V: how far the mass holds the motions by itself
  Vec motion(Eigen::Index i) const { return motions_[static_cast<std::size_t>(i)]; }  ///< a column of Z
  /// A column of W, the motion's unknowns alone, of K~ and of its transpose.
  Vec along(Eigen::Index i) const { return along_[static_cast<std::size_t>(i)]; }
  Vec along_transposed(Eigen::Index i) const {
    return (along_transposed_.empty() ? along_ : along_transposed_)[static_cast<std::size_t>(i)];
  }

 private:
  using Solve = std::function<void(Vec, Vec)>;
  Eigen::VectorXd dots(const std::vector<VecHandle>& with, Vec x) const;
  void combine(const std::vector<VecHandle>& of, const Eigen::VectorXd& by, Vec x) const;
  void find_inertia(const std::vector<VecHandle>& along, const Apply& mass);
  void respond(const Solve& solve, const Apply& mass, std::vector<VecHandle>& inner, std::vector<VecHandle>& along);

  VecHandle right_;                                             // a vector of the operator
  std::vector<VecHandle> motions_, inner_, along_;              // Z, V, W
  std::vector<VecHandle> inner_transposed_, along_transposed_;  // V, W of the transpose, empty where they are the same
  std::vector<PetscInt> springs_;                               // global unknowns, one a motion
  std::vector<double> stiffness_;
  double share_ = 0;
  Eigen::MatrixXd inertia_, gram_, at_springs_;  // H, Z^T Z, Z at the springs
};

}  // namespace warmslip
