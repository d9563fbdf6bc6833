// Semismooth Newton on the contact unknowns alone. The body enters through its compliance C only: a contact force
// lambda changes the velocities of the contact points from `free` to free - C lambda. Eigen only, no PETSc, no MPI.
#pragma once
#include <string>
#include <vector>

#include "warmslip/contact.hpp"

namespace warmslip {

struct ContactOptions {
  double tolerance = 1e-12;  ///< on the residual of the contact law, relative
  int newton_steps = 40;     ///< undamped, then again with a line search
  int fixed_point_steps = 4000;
  int enumerate_points = 6;  ///< enumerate the statuses of at most so many points (d = 2)
  double proximal = 0;       ///< > 0 where contact points outnumber contact nodes; dimensionless
};

/// Which safeguard produced the answer.
enum class Stage : std::int8_t { none, newton, line_search, fixed_point, enumeration };

template <int d>
struct ContactProblem {
  std::vector<ContactLaw> laws;
  double step;  ///< k, time
  std::vector<ContactPoint<d>> points;
  Eigen::VectorXd free;  ///< (d points), velocity without contact force
  double scale = 0;      ///< a force of the problem's size, such as stops `free`: what no force is compared with

  const ContactLaw& law(std::size_t point) const { return laws[points[point].law]; }
};

template <int d>
struct ContactSolution {
  Eigen::VectorXd force, velocity;  ///< (d points)
  std::vector<Status> status;
  bool converged = false;
  Stage stage = Stage::none;
  int iterations = 0;       ///< Newton steps of all stages
  int factorizations = 0;   ///< of the dense tangent
  double law_residual = 0;  ///< of the contact law, relative; accepted up to tolerance + floor
  double floor = 0;         ///< round-off of evaluating the law: c_nu eps (|u| + k |free|) over the largest pressure
};

/// How far (force, velocity) is from the law, relative to the largest force and the largest free velocity: the worst of
/// |lambda_nu - p_nu(r_n)|, (|lambda_tau| - T)^+ and T |w_tau| - lambda_tau . w_tau over the points. `floor` receives
/// what the rounding of r alone can cause where it may touch: no digits of the pressure below p_nu' eps (|u| + k
/// |free|) can be had.
template <int d>
double law_residual(const ContactProblem<d>& problem, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity,
                    double* floor);

/// One body, laws and step size. Remembers the dense tangent while the statuses stay (piecewise linear laws, d = 2),
/// which is most steps of most runs.
template <int d>
class ContactSolver {
 public:
  ContactSolver(Eigen::MatrixXd compliance, ContactOptions options = {});

  /// Solves from the guess `force` (d points). Never throws on failure to converge: `converged` says so.
  ContactSolution<d> solve(const ContactProblem<d>& problem, const Eigen::VectorXd& force);

  /// Drops the remembered tangent: the next solve does what a new solver would, to the last bit.
  void forget() { factored_.clear(); }
  const Eigen::MatrixXd& compliance() const { return compliance_; }
  /// The force a point that stops the velocities `free` must bear.
  double scale(const Eigen::VectorXd& free) const { return spectral_ > 0 ? free.cwiseAbs().maxCoeff() / spectral_ : 0; }

 private:
  struct Linearisation;
  Linearisation linearise(const ContactProblem<d>& problem, const Eigen::VectorXd& force) const;
  void factor(const ContactProblem<d>& problem, const Linearisation& at, ContactSolution<d>& solution);
  Eigen::VectorXd direction(const Linearisation& at, const Eigen::VectorXd& force) const;
  bool newton(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution);
  bool fixed_point(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool enumerate(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  void polish(const ContactProblem<d>& problem, ContactSolution<d>& solution);
  bool accept(const ContactProblem<d>& problem, ContactSolution<d>& solution) const;

  Eigen::MatrixXd compliance_;
  ContactOptions options_;
  Eigen::VectorXd reach_;             // row sums of |compliance|
  double spectral_ = 0;               // their largest, a bound on the eigenvalues of the compliance
  std::vector<int> factored_;         // statuses the tangent below belongs to
  std::vector<Eigen::Index> closed_;  // its rows: the components of the points in contact
  Eigen::PartialPivLU<Eigen::MatrixXd> tangent_;
};

}  // namespace warmslip
