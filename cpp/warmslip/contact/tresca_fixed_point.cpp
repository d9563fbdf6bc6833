// Where Newton's method does not converge: a fixed point on the friction bounds (Tresca's friction in every pass).
#include <algorithm>
#include <cmath>

#include "warmslip/contact/linearisation.hpp"

namespace warmslip {

namespace {

constexpr int cycle = 9;  // steps

// Of the proximal term, against a point's own compliance: firm ones converge in fewer steps and soft ones round less.
double firmness_of(int step) { return 32 * std::pow(4.0, step % cycle); }

// The law of every point with the friction bound that belongs to a force and a velocity, kept as a constant.
template <int d>
void freeze(const ContactProblem<d>& problem, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity,
            double part, ContactProblem<d>& frozen) {
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> w = velocity.template segment<d>(row);
    const double pressure = std::max(0.0, force.template segment<d>(row).dot(point.normal)) / point.weight,
                 speed = (w - w.dot(point.normal) * point.normal).norm();
    double& kept = frozen.laws[i].friction.cohesion;
    kept += part * (problem.law(i).friction.bound(pressure, speed).value - kept);
  }
}

}  // namespace

// With constant friction bounds, and forces drawn towards those of `centre`, the motion minimises a convex function
// with a continuous gradient: 1/2 added . C added, the energy of the rigid motions and the law's own, smoothed.
// Newton's method with a search for a small slope along its direction finds the minimum from anywhere.
template <int d>
bool ContactSolver<d>::convex(const ContactProblem<d>& problem, const Eigen::VectorXd& centre, double firmness,
                              ContactSolution<d>& solution) {
  const Eigen::Index all = compliance_.rows(), motions = rigid_.count();
  const Eigen::VectorXd motions_before = solution.rigid;
  const auto unmet = [&](const Eigen::VectorXd& added, const Eigen::VectorXd& rigid) {
    Linearisation at = motion(problem, added, rigid);
    at.value.tail(motions) += lent_mass_ * (rigid - motions_before);
    const Eigen::VectorXd force = at.value.head(all);
    at.value.head(all) = centre;
    apply_law(problem, firmness, at);
    at.value.head(all) += force - centre;
    for (auto& point : at.points) point.by_force.setIdentity();
    return at;
  };
  Linearisation at = unmet(solution.added, solution.rigid);
  double size = at.value.norm();
  for (int step = 0; step < 50; ++step) {
    factor(problem, at, solution);
    const Eigen::VectorXd change = direction(at);
    if (!change.allFinite()) return false;
    ++solution.iterations;
    Eigen::VectorXd moved = -compliance_ * change.head(all);
    if (motions > 0) moved += rigid_unit_ * rigid_.motions * change.tail(motions);
    const auto slope = [&](const Linearisation& there) {
      return rigid_unit_ * change.tail(motions).dot(there.value.tail(motions)) - there.value.head(all).dot(moved);
    };
    const double before = slope(at);
    double low = 0, high = 1, length = 1;
    Linearisation next;
    for (int i = 0; i < 60; ++i) {  // the slope grows along the direction
      next = unmet(solution.added + length * change.head(all), solution.rigid + length * change.tail(motions));
      const double now = slope(next);
      if (std::abs(now) <= 0.5 * std::abs(before) || (now <= 0 && length == 1)) break;
      (now > 0 ? high : low) = length;
      length = 0.5 * (low + high);
    }
    solution.added += length * change.head(all);
    solution.rigid += length * change.tail(motions);
    at = std::move(next);
    const double now = at.value.norm(), forces = total(problem, solution.added).norm();
    if (now <= 1e-13 * forces || (now <= 1e-13 * firmness * forces && now >= 0.5 * size)) break;
    size = now;
  }
  return true;
}

// Friction bounds frozen, the step is convex: draw near its solution, move the bounds half way,
// repeat; Newton finishes from there. An augmented Lagrangian for the forces and a fixed point for the bounds at once,
// indifferent to stiffness.
template <int d>
bool ContactSolver<d>::tresca_fixed_point(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const double proximal = options_.proximal;
  ContactProblem<d> frozen = problem;
  frozen.laws.clear();
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    frozen.points[i].law = i;
    frozen.laws.push_back({problem.law(i).compliance, {}});
    frozen.laws[i].friction.regularisation = problem.law(i).friction.regularisation;
  }
  Eigen::VectorXd force = total(problem, solution.added),
                  velocity = motion(problem, solution.added, solution.rigid).velocity;
  ContactSolution<d> best;  // the tolerance is met: some steps more may reach round-off
  int last = options_.fixed_point_steps;
  for (int step = 0; step < last; ++step) {
    if (best.converged && best.law_residual <= 1e-2 * options_.tolerance) break;
    const double firmness = firmness_of(step);
    freeze(problem, force, velocity, step == 0 ? 1.0 : 0.5, frozen);
    clear_cache();
    lent_mass_ = 1 / firmness;
    const bool solved = convex(frozen, force, firmness, solution);
    lent_mass_ = 0;
    if (!solved) break;
    force = total(problem, solution.added);
    velocity = motion(problem, solution.added, solution.rigid).velocity;
    ContactSolution<d> finished = solution;
    finished.force = force;
    finished.velocity = velocity;
    if (!accept(problem, finished) && step % 10 != 9 && (step & (step + 1)) != 0) continue;
    for (const double part : {1.0, 1e-3}) {  // near the solution less has to draw points to the share they had
      clear_cache();
      finished = solution;
      options_.proximal = part * proximal;
      const bool done = newton(problem, part == 1, finished);
      options_.proximal = proximal;
      if (done && !(best.converged && finished.law_residual >= best.law_residual)) {
        if (!best.converged) last = std::min(last, step + 2 * cycle);
        best = finished;
        best.converged = true;
      }
      solution.iterations = finished.iterations;
      solution.factorizations = finished.factorizations;
    }
  }
  if (!best.converged) return false;
  best.iterations = solution.iterations;
  best.factorizations = solution.factorizations;
  solution = std::move(best);
  return true;
}

template bool ContactSolver<2>::tresca_fixed_point(const ContactProblem<2>&, ContactSolution<2>&);
template bool ContactSolver<3>::tresca_fixed_point(const ContactProblem<3>&, ContactSolution<3>&);

}  // namespace warmslip
