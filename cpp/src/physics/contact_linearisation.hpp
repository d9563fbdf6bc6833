// What Newton's method and its safeguards share: forces counted from the known ones, and the linearised law.
#pragma once
#include <algorithm>

#include "warmslip/contact_solver.hpp"

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
bool by_status(const ContactProblem<d>& problem) {
  return d == 2 && std::all_of(problem.laws.begin(), problem.laws.end(),
                               [](const ContactLaw& law) { return law.piecewise_linear(); });
}

template <int d>
struct ContactSolver<d>::Linearisation {
  Eigen::VectorXd velocity, value;  // value: of all points, then of the rigid motions
  std::vector<PointResidual<d>> points;
  std::vector<int> key;  // what the tangent depends on
};

}  // namespace warmslip
