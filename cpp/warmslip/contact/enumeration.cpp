// All statuses of a few points in turn, each a linear problem.
#include "warmslip/contact/linearisation.hpp"

namespace warmslip {

template <int d>
bool ContactSolver<d>::enumerate(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const auto count = problem.points.size();
  if (!tangent_depends_on_status_only(problem) || count > static_cast<std::size_t>(options_.enumerate_points))
    return false;
  for (const ContactLaw& law : problem.laws)  // a bound that is there without pressure has more statuses
    if (law.friction.cohesion > 0) return false;
  const Eigen::Index all = compliance_.rows(), m = rigid_.count();
  const Eigen::VectorXd none = beyond_known<d>(problem, Eigen::VectorXd::Zero(all));  // minus the known forces
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(all + m, all + m);
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(all + m);
  if (m > 0) {
    system.bottomLeftCorner(m, all) = rigid_.loads.transpose();
    system.bottomRightCorner(m, m) = rigid_unit_ * rigid_.inertia;
    loads.tail(m) = problem.rigid - rigid_.loads.transpose() * none;
  }
  const bool unsupported = solution.unsupported;
  const double k = problem.step;
  for (std::size_t code = 0, codes = std::size_t{1} << (2 * count); code < codes; ++code) {
    Eigen::MatrixXd by_force = Eigen::MatrixXd::Zero(compliance_.rows(), compliance_.cols()), by_velocity = by_force;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(compliance_.rows());
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = static_cast<Eigen::Index>(i) * 2;
      const auto& point = problem.points[i];
      const Eigen::Vector2d nu = point.normal.template head<2>(), tau(-nu[1], nu[0]);
      const auto choice = code >> (2 * i) & 3;  // 0 open, 1 stick, 2 and 3 slip
      const ContactLaw& law = problem.law(i);
      const PointCompliance scales = diagonal_block(problem, i);
      const auto per = [](double compliance) { return compliance > 0 ? 1 / compliance : 1.0; };
      // by_force force + by_velocity velocity = right, in units of force
      if (choice == 0 || !law.compliance.rigid()) {
        const double spring = choice == 0 ? 0 : point.weight * law.compliance.stiffness;
        by_force.block<1, 2>(row, row) = nu.transpose();
        by_velocity.block<1, 2>(row, row) = -spring * k * nu.transpose();
        right[row] = spring * point.penetration;
      } else {  // it goes no deeper
        by_velocity.block<1, 2>(row, row) = per(scales.normal) * k * nu.transpose();
        right[row] = -per(scales.normal) * point.penetration;
      }
      if (choice == 1) {
        by_velocity.block<1, 2>(row + 1, row) = per(scales.tangential) * tau.transpose();
      } else {
        const double drag = choice == 0 ? 0 : (choice == 2 ? 1 : -1) * law.friction.coefficient;
        by_force.block<1, 2>(row + 1, row) = (tau - drag * nu).transpose();
      }
    }
    system.topLeftCorner(all, all) = by_force - by_velocity * compliance_;
    if (m > 0) system.topRightCorner(all, m) = rigid_unit_ * by_velocity * rigid_.motions;
    loads.head(all) = right - by_velocity * problem.free;
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(system);
    const Eigen::VectorXd found = lu.solve(loads);
    if (!found.allFinite() || (m > 0 && !lu.isInvertible())) continue;
    solution.force = found.head(all);
    solution.rigid = found.tail(m);
    solution.added = beyond_known(problem, solution.force);
    const Linearisation at = linearise(problem, solution.added, solution.rigid);
    solution.velocity = at.velocity;
    if (!accept(problem, solution)) continue;
    if (m > 0 && !is_supported(problem, solution)) continue;
    solution.status.clear();
    for (const auto& point : at.points) solution.status.push_back(point.status);
    return true;
  }
  solution.unsupported = unsupported;
  return false;
}

template bool ContactSolver<2>::enumerate(const ContactProblem<2>&, ContactSolution<2>&);
template bool ContactSolver<3>::enumerate(const ContactProblem<3>&, ContactSolution<3>&);

}  // namespace warmslip
