// What Newton's method and its safeguards share: forces counted from the known ones, and the linearised law.
#pragma once
#include <algorithm>

#include "warmslip/contact/residual.hpp"
#include "warmslip/contact/solver.hpp"

namespace warmslip {

template <int d>
const Eigen::VectorXd& known_velocity(const ContactProblem<d>& problem) {
  return problem.known_force.size() > 0 ? problem.known_velocity : problem.free;
}

// The forces of what is added to the known ones, and back.
template <int d>
Eigen::VectorXd total(const ContactProblem<d>& problem, const Eigen::VectorXd& added) {
  return problem.known_force.size() > 0 ? Eigen::VectorXd(problem.known_force + added) : added;
}
template <int d>
Eigen::VectorXd beyond_known(const ContactProblem<d>& problem, const Eigen::VectorXd& force) {
  return problem.known_force.size() > 0 ? Eigen::VectorXd(force - problem.known_force) : force;
}

// Whether statuses alone make the tangent.
template <int d>
bool tangent_depends_on_status_only(const ContactProblem<d>& problem) {
  return d == 2 && std::all_of(problem.laws.begin(), problem.laws.end(),
                               [](const ContactLaw& law) { return law.piecewise_linear(); });
}

template <int d>
struct ContactSolver<d>::Linearisation {
  Eigen::VectorXd velocity, value;  // value: of all points, then of the rigid motions
  std::vector<PointResidual<d>> points;
  std::vector<int> key;  // what the tangent depends on
};

// Other scales and limits for as long as it lives, and a tangent of their own; also when memory runs out on the way.
template <int d>
struct ContactSolver<d>::Trial {
  explicit Trial(ContactSolver& owner) : solver(owner), options(owner.options_) { solver.clear_cache(); }
  ~Trial() {
    solver.carries_ = solver.terms_cancel_ = false;
    solver.tangential_scale_ = 1;
    solver.stiff_proximal_ = 0;
    solver.spring_ = 0;
    solver.lent_mass_ = 0;
    solver.options_ = options;
    solver.clear_cache();
  }
  Trial(const Trial&) = delete;
  ContactSolver& solver;
  ContactOptions options;
};

}  // namespace warmslip
