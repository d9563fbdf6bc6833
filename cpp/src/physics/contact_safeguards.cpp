// Where Newton's method does not converge: a fixed point that is indifferent to stiffness, and all statuses in turn.
#include <algorithm>
#include <cmath>

#include "contact_linearisation.hpp"

namespace warmslip {

// Thresholds frozen, the step is convex: minimise 1/2 l.C l - l.free plus the law's conjugate by accelerated proximal
// gradients, move the thresholds, repeat; Newton finishes from there. Slow, and indifferent to stiffness and statuses.
template <int d>
bool ContactSolver<d>::fixed_point(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  if (rigid_.count() > 0) return false;
  for (const ContactLaw& law : problem.laws)  // smooth: no threshold to freeze
    if (law.friction.regularisation > 0) return false;
  const double rate = 1 / spectral_, k = problem.step;
  // lambda = weight p_nu(r) with r = penetration + k (z - lambda) / rate: falls on the right, rises on the left
  const auto normal_force = [&](const ContactPoint<d>& point, const NormalCompliance& law, double z) {
    if (law.linear()) {
      const double spring = point.weight * law.stiffness * k;  // force per velocity
      return spring > 0 ? std::max(0.0, (z + rate * point.penetration / k) / (1 + rate / spring)) : 0.0;
    }
    // no more than what holds the point at r = 0; a law of the user's may know no pressure beyond
    double low = 0, high = std::min(point.weight * law.pressure(point.penetration + k * z / rate),
                                    std::max(0.0, z + rate * point.penetration / k));
    for (int i = 0; i < 60 && low < high; ++i) {
      const double middle = 0.5 * (low + high);
      (point.weight * law.pressure(point.penetration + k * (z - middle) / rate) > middle ? low : high) = middle;
    }
    return 0.5 * (low + high);
  };
  const auto prox = [&](const Eigen::VectorXd& z, const Eigen::VectorXd& bounds) {
    Eigen::VectorXd out(z.size());
    for (std::size_t i = 0; i < problem.points.size(); ++i) {
      const auto& point = problem.points[i];
      const auto row = static_cast<Eigen::Index>(i) * d;
      const double zn = z.template segment<d>(row).dot(point.normal);
      const double normal = normal_force(point, problem.law(i).compliance, zn);
      Point<d> tangential = z.template segment<d>(row) - zn * point.normal;
      const double bound = bounds[static_cast<Eigen::Index>(i)];
      if (tangential.norm() > bound) tangential *= bound / tangential.norm();
      out.template segment<d>(row) = normal * point.normal + tangential;
    }
    return out;
  };
  Eigen::VectorXd force = total(problem, solution.added), momentum = force,
                  bounds(static_cast<Eigen::Index>(problem.points.size()));
  Eigen::VectorXd velocity = problem.free;
  const auto under = [&](const Eigen::VectorXd& forces) -> Eigen::VectorXd {
    return known_velocity(problem) - compliance_ * beyond_known(problem, forces);
  };
  const auto threshold = [&](std::size_t i) {
    const auto& point = problem.points[i];
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> w = velocity.template segment<d>(row);
    const double pressure = std::max(0.0, force.template segment<d>(row).dot(point.normal)) / point.weight;
    return point.weight *
           problem.law(i).friction.bound(pressure, (w - w.dot(point.normal) * point.normal).norm()).value;
  };
  double inertia = 1;
  for (int step = 0; step < options_.fixed_point_steps; ++step) {
    if (step % 20 == 0) {
      velocity = under(force);
      for (std::size_t i = 0; i < problem.points.size(); ++i) bounds[static_cast<Eigen::Index>(i)] = threshold(i);
      momentum = force;
      inertia = 1;
    }
    const Eigen::VectorXd next = prox(momentum + rate * under(momentum), bounds);
    if (!next.allFinite()) return false;
    const double stronger = (1 + std::sqrt(1 + 4 * inertia * inertia)) / 2;
    momentum = next + (inertia - 1) / stronger * (next - force);
    force = next;
    inertia = stronger;
    if (step % 200 == 199) {
      solution.added = beyond_known(problem, force);
      if (newton(problem, true, solution)) return true;
      solution.added = beyond_known(problem, force);
      if (newton(problem, false, solution)) return true;
    }
  }
  return false;
}

template <int d>
bool ContactSolver<d>::enumerate(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const auto count = problem.points.size();
  if (!by_status(problem) || count > static_cast<std::size_t>(options_.enumerate_points)) return false;
  for (const ContactLaw& law : problem.laws)  // a bound that is there without pressure has more statuses
    if (law.friction.cohesion > 0 || law.compliance.rigid()) return false;
  if (rigid_.count() > 0) return false;
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
      const double spring = choice == 0 ? 0 : point.weight * law.compliance.stiffness;
      const double drag = choice < 2 ? 0 : (choice == 2 ? 1 : -1) * law.friction.coefficient * spring;
      by_force.block<1, 2>(row, row) = nu.transpose();
      by_velocity.block<1, 2>(row, row) = -spring * k * nu.transpose();
      right[row] = spring * point.penetration;
      if (choice == 1) {
        by_velocity.block<1, 2>(row + 1, row) = tau.transpose();
      } else {
        by_force.block<1, 2>(row + 1, row) = tau.transpose();
        by_velocity.block<1, 2>(row + 1, row) = -drag * k * nu.transpose();
        right[row + 1] = drag * point.penetration;
      }
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(by_force - by_velocity * compliance_);
    solution.force = lu.solve(right - by_velocity * problem.free);
    if (!solution.force.allFinite()) continue;
    solution.added = beyond_known(problem, solution.force);
    const Linearisation at = linearise(problem, solution.added, solution.rigid);
    solution.velocity = at.velocity;
    if (!accept(problem, solution)) continue;
    solution.status.clear();
    for (const auto& point : at.points) solution.status.push_back(point.status);
    return true;
  }
  return false;
}

template bool ContactSolver<2>::fixed_point(const ContactProblem<2>&, ContactSolution<2>&);
template bool ContactSolver<3>::fixed_point(const ContactProblem<3>&, ContactSolution<3>&);
template bool ContactSolver<2>::enumerate(const ContactProblem<2>&, ContactSolution<2>&);
template bool ContactSolver<3>::enumerate(const ContactProblem<3>&, ContactSolution<3>&);

}  // namespace warmslip
