// Semismooth Newton on the contact unknowns alone. The body enters through its compliance C only: a contact force
// lambda changes the velocities of the contact points from `free` to free - C lambda. Eigen only, no PETSc, no MPI.
#pragma once
#include <vector>

#include "warmslip/contact/problem.hpp"

namespace warmslip {

/// One body, laws and step size. Remembers the dense tangent while the statuses stay (piecewise linear laws, d = 2),
/// which is most steps of most runs.
template <int d>
class ContactSolver {
 public:
  ContactSolver(Eigen::MatrixXd compliance, ContactOptions options = {}, RigidCoupling rigid = {});

  /// Solves from the guess `force` (d points). Never throws on failure to converge: `converged` says so.
  ContactSolution<d> solve(const ContactProblem<d>& problem, const Eigen::VectorXd& force);

  /// What a small change of the free velocities, (d points), and of the load on the rigid motions, `problem.rigid`,
  /// adds to a solution that is the known one of `problem`, statuses kept: `added`, `force` and `rigid` of it. Points
  /// that are `resting` (points; none if empty) stick whatever they do. False where the tangent is singular.
  bool respond(const ContactProblem<d>& problem, const Eigen::VectorXd& change, const std::vector<bool>& resting,
               ContactSolution<d>& solution);

  /// Drops the remembered tangent: the next solve does what a new solver would, to the last bit.
  void clear_cache() { tangent_status_.clear(); }
  const Eigen::MatrixXd& compliance() const { return compliance_; }
  const RigidCoupling& coupling() const { return rigid_; }

 private:
  struct Linearisation;
  struct Trial;
  // A point in the dense tangent, with as many components of its force as are not known to be 0.
  struct ActivePoint {
    using Basis = Eigen::Matrix<double, d, Eigen::Dynamic, Eigen::ColMajor, d, d>;
    Eigen::Index row, at;  // its first component among all, and in the tangent
    Basis basis;           // of the force that is sought, orthonormal

    Eigen::Index size() const { return basis.cols(); }
  };
  Linearisation motion(const ContactProblem<d>& problem, const Eigen::VectorXd& added,
                       const Eigen::VectorXd& rigid) const;
  void apply_law(const ContactProblem<d>& problem, double firmness, Linearisation& at) const;
  Linearisation linearise(const ContactProblem<d>& problem, const Eigen::VectorXd& added,
                          const Eigen::VectorXd& rigid) const;
  void prescribed(const ContactProblem<d>& problem, Linearisation& at, std::size_t point) const;
  void factor(const ContactProblem<d>& problem, const Linearisation& at, ContactSolution<d>& solution);
  Eigen::VectorXd direction(const Linearisation& at) const;
  Tensor2<d> shared(const ContactProblem<d>& problem, const PointResidual<d>& at, Eigen::Index point) const;
  bool newton(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution);
  bool convex(const ContactProblem<d>& problem, const Eigen::VectorXd& centre, double firmness,
              ContactSolution<d>& solution);
  bool is_supported(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool kept_coefficients(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool tresca_fixed_point(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool enumerate(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  void polish(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  void assume_all_stick(const ContactProblem<d>& problem, ContactSolution<d>& solution) const;
  bool newton_with_spring(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution);
  void stick_at_one_point(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool newton_with_lent_mass(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  void find_resisted();
  bool accept(const ContactProblem<d>& problem, ContactSolution<d>& solution, double rest = unlimited) const;
  PointCompliance diagonal_block(const ContactProblem<d>& problem, std::size_t point) const;

  Eigen::MatrixXd compliance_;
  ContactOptions options_;
  RigidCoupling rigid_;
  double tangential_scale_ = 1;      // of the tangential rows, against the reciprocal of the point's own compliance
  Eigen::MatrixXd carried_;          // (d, d points): blocks of motions inertia^-1 motions^T on the diagonal
  double stiff_proximal_ = 0;        // > 0: pressed points share their force on a stiff foundation as on a rigid one
  double spring_ = 0;                // > 0: force per velocity that holds a body without mass while nothing else does
  double lent_mass_ = 0;             // > 0: an inertia that draws the rigid motions to where they were, dimensionless
  bool lent_ = false;                // whether its mass is lent by the solver of a body without mass
  bool carries_ = false;             // whether a point's own compliance includes the rigid motions
  bool terms_cancel_ = false;        // whether rounding of terms that cancel is no residual, see accept
  bool massive_ = false;             // whether a mass or springs resist every rigid motion
  Eigen::MatrixXd resisted_;         // projector onto the rigid motions that they resist, (motions, motions)
  double rigid_unit_ = 1;            // velocity per force, the unit of the rigid motions
  double compliance_norm_ = 0;       // largest row sum of |compliance|, a bound on its eigenvalues
  std::vector<int> tangent_status_;  // statuses the tangent below belongs to
  bool unsupported_ = false;         // whether it leaves a rigid motion undetermined
  std::vector<ActivePoint> active_points_;  // its rows: the points in contact
  Eigen::PartialPivLU<Eigen::MatrixXd> tangent_;
};

}  // namespace warmslip
