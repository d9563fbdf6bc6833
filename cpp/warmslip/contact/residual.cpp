#include "warmslip/contact/residual.hpp"

#include <algorithm>
#include <cmath>

namespace warmslip {
namespace {

// How far the penetration r is from those that bear `pressure`; infinite where none does, or none is known to.
double distance(const NormalCompliance& law, double pressure, double r) {
  if (pressure == 0) return std::max(r, 0.0);
  if (law.rigid()) return std::abs(r);
  if (law.custom) {
    const double slope = law.tangent(r);
    return slope > 0 ? std::abs(pressure - law.pressure(r)) / slope : unlimited;
  }
  if (law.stiffness == 0) return unlimited;
  if (law.at_limit(pressure)) return pressure > law.pressure_limit ? unlimited : std::max(law.deepest_rise() - r, 0.0);
  return std::abs(r - law.penetration(pressure, r));
}

}  // namespace

template <int d>
double law_residual(const ContactProblem<d>& problem, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity,
                    const Point<d>& least) {
  double largest = 0, max_speed = least.norm() / problem.step, max_bound = 0;
  Point<d> motion = least;  // the largest terms of the displacements, component by component
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto& point = problem.points[i];
    if (point.prescribed) continue;
    const auto at = static_cast<Eigen::Index>(i) * d;
    const Point<d> f = force.template segment<d>(at), w = velocity.template segment<d>(at),
                   free = problem.free.template segment<d>(at);
    const double speed = (w - w.dot(point.normal) * point.normal).norm(), lambda = f.dot(point.normal);
    // the velocity is what the contact force leaves of the free one
    motion = motion.cwiseMax(point.displacement.cwiseAbs() + problem.step * (w.cwiseAbs() + free.cwiseAbs()));
    max_speed = std::max({max_speed, free.norm(), w.norm()});
    largest = std::max(largest, f.norm());
    max_bound = std::max(
        max_bound, point.weight * problem.law(i).friction.bound(std::max(lambda, 0.0) / point.weight, speed).value);
  }
  if (!force.allFinite() || !motion.allFinite() || !std::isfinite(max_speed))
    return std::numeric_limits<double>::infinity();
  largest = std::max(largest, max_bound);
  const double rounding = 2 * std::numeric_limits<double>::epsilon() * motion.norm();  // of a penetration
  double worst = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const auto at = static_cast<Eigen::Index>(i) * d;
    const Point<d> f = force.template segment<d>(at), w = velocity.template segment<d>(at);
    const double r = point.penetration + problem.step * w.dot(point.normal), lambda = f.dot(point.normal);
    const double reach = motion.dot(point.normal.cwiseAbs()) + std::abs(point.gap);
    if (!std::isfinite(reach)) return unlimited;
    const Point<d> f_tau = f - lambda * point.normal, w_tau = w - w.dot(point.normal) * point.normal;
    const double bound = point.weight * law.friction.bound(std::max(lambda, 0.0) / point.weight, w_tau.norm()).value;
    if (point.prescribed && law.compliance.rigid()) {  // it bears no pressure, and may be in by rounding alone
      const double own = point.displacement.norm() + std::abs(point.gap) + problem.step * w.norm();
      if (r > 0) worst = std::max(worst, r / std::max(reach, own));
    }
    if (point.prescribed) {  // its force is computed from its motion alone
      const double size = std::max(f.norm(), bound),
                   error = std::abs(lambda - (law.compliance.rigid() ? 0 : point.weight * law.compliance.pressure(r)));
      if (!std::isfinite(error)) return unlimited;
      if (size > 0) worst = std::max({worst, error / size, (f_tau.norm() - bound) / size});
      continue;
    }
    const double off = std::abs(lambda - point.weight * law.compliance.pressure(r)),
                 away = std::max(distance(law.compliance, std::max(lambda, 0.0) / point.weight, r) - rounding, 0.0),
                 pull = std::max(-lambda, 0.0);
    const auto of_forces = [&](double force) { return largest > 0 ? force / largest : unlimited; };
    const double apart = std::max(away > 0 ? away / reach : 0.0, pull > 0 ? of_forces(pull) : 0.0);
    const double normal = off == 0 ? 0 : std::min(of_forces(off), apart);
    // a bound far below the normal force is known to the rounding of that force, which lies askew to the axes
    const double friction = friction_defect<d>(
        law.friction, bound, f_tau, w_tau, std::max(max_bound > 0 ? max_bound : largest, 1e-3 * f.norm()), max_speed);
    if (!(normal < unlimited) || !(friction < unlimited)) return unlimited;
    worst = std::max({worst, normal, friction});
  }
  return worst;
}

template double law_residual<2>(const ContactProblem<2>&, const Eigen::VectorXd&, const Eigen::VectorXd&,
                                const Point<2>&);
template double law_residual<3>(const ContactProblem<3>&, const Eigen::VectorXd&, const Eigen::VectorXd&,
                                const Point<3>&);

}  // namespace warmslip
