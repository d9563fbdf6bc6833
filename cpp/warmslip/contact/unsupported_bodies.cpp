// Bodies that nothing but contact holds, and that may have to come to it first.
#include <algorithm>

#include "warmslip/contact/linearisation.hpp"

namespace warmslip {

// Forces and rigid motions under which all points that can move are pressed and stick: where such a body is to come to
// rest. Points that pull there open in the next step.
template <int d>
void ContactSolver<d>::assume_all_stick(const ContactProblem<d>& problem, ContactSolution<d>& solution) const {
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    if (const PointCompliance scales = diagonal_block(problem, i); scales.normal > 0 && scales.tangential > 0)
      for (int c = 0; c < d; ++c) rows.push_back(static_cast<Eigen::Index>(i) * d + c);
  const auto n = static_cast<Eigen::Index>(rows.size()), m = rigid_.count();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + m, n + m);
  Eigen::VectorXd right(n + m);
  system.topLeftCorner(n, n) = -compliance_(rows, rows);
  system.topRightCorner(n, m) = rigid_unit_ * rigid_.motions(rows, Eigen::all);
  system.bottomLeftCorner(m, n) = rigid_.loads(rows, Eigen::all).transpose();
  system.bottomRightCorner(m, m) = rigid_unit_ * rigid_.inertia;
  right << -problem.free(rows), problem.rigid;
  for (Eigen::Index row = 0; row < n; row += d) {
    const auto i = static_cast<std::size_t>(rows[static_cast<std::size_t>(row)] / d);
    const ContactPoint<d>& point = problem.points[i];
    const NormalCompliance& law = problem.law(i).compliance;
    right.template segment<d>(row) -= point.penetration / problem.step * point.normal;
    if (law.linear() && law.stiffness > 0)
      system.template block<d, d>(row, row) -=
          point.normal * point.normal.transpose() / (point.weight * law.stiffness * problem.step);
  }
  const Eigen::VectorXd found = system.completeOrthogonalDecomposition().solve(right);  // shares and slips as they fall
  Eigen::VectorXd force = Eigen::VectorXd::Zero(compliance_.rows());
  force(rows) = found.head(n);
  solution.added = beyond_known(problem, force);
  solution.rigid = found.tail(m);
}

// Newton from there, on a leash while nothing holds the body.
template <int d>
bool ContactSolver<d>::newton_with_spring(const ContactProblem<d>& problem, bool line_search,
                                          ContactSolution<d>& solution) {
  double reach = problem.step * problem.free.cwiseAbs().maxCoeff();
  for (const ContactPoint<d>& point : problem.points) reach = std::max(reach, std::abs(point.penetration));
  const Trial trial(*this);
  if (!line_search && reach > 0) spring_ = problem.step * problem.rigid.cwiseAbs().maxCoeff() / reach;
  assume_all_stick(problem, solution);
  return newton(problem, line_search, solution) && is_supported(problem, solution);
}

// A body without mass is lent some. Each solve starts from where the last one ended and the mass falls, so that the
// body is drawn to where friction alone holds it.
template <int d>
bool ContactSolver<d>::newton_with_lent_mass(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const Eigen::Index m = rigid_.count();
  ContactProblem<d> heavy = problem;
  RigidCoupling lent = rigid_;
  assume_all_stick(problem, solution);
  double mass = 1, unbalanced = 0;
  for (int step = 0; step < 40; ++step, mass /= 4) {
    lent.inertia = mass / rigid_unit_ * Eigen::MatrixXd::Identity(m, m);
    heavy.rigid = problem.rigid + mass * solution.rigid;
    ContactSolver heavier(compliance_, options_, lent);
    heavier.lent_ = true;
    ContactSolution<d> found = heavier.solve(heavy, total(problem, solution.added));
    solution.iterations += found.iterations;
    solution.factorizations += found.factorizations;
    if (!found.converged) return false;
    const double before = unbalanced;
    unbalanced = mass * (found.rigid / rigid_unit_ - solution.rigid).norm();
    if (step > 3 && unbalanced >= 0.5 * before && unbalanced > 1e-6 * found.force.norm()) return false;  // it is off
    solution.added = found.added;
    solution.rigid = found.rigid / rigid_unit_;
    ContactSolution<d> finished = solution;
    clear_cache();
    const bool done = newton(problem, true, finished) && is_supported(problem, finished);
    solution.iterations = finished.iterations;
    solution.factorizations = finished.factorizations;
    solution.unsupported = finished.unsupported;
    if (done) {
      solution = std::move(finished);
      return true;
    }
  }
  return false;
}

// A body whose mass holds it to fewer than four digits may be held by a point that sticks: where it would be without
// mass.
template <int d>
void ContactSolver<d>::stick_at_one_point(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  RigidCoupling light = rigid_;
  light.inertia.setZero();
  ContactOptions quick = options_;
  quick.fixed_point_steps = 0;
  const ContactSolution<d> rest =
      ContactSolver(compliance_, quick, light).solve(problem, total(problem, solution.added));
  if (!rest.converged || rest.undetermined) return;
  ContactSolution<d> held = solution;
  held.added = rest.added;
  held.rigid = rest.rigid / rigid_unit_;
  held.stage = Stage::restart;
  clear_cache();
  if (newton(problem, true, held)) solution = std::move(held);
}

// Whether a solution that was found with something else to hold the body is held by the points alone. A point that
// touches without a force holds nothing: the body may turn away from it. Where points slip with friction, that may
// leave some room to the body, and this is one of several solutions.
template <int d>
bool ContactSolver<d>::is_supported(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  spring_ = lent_mass_ = 0;
  Linearisation at = linearise(problem, solution.added, solution.rigid);
  const Eigen::VectorXd force = total(problem, solution.added);
  for (std::size_t i = 0; i < at.points.size(); ++i) {
    const double lambda = force.segment<d>(static_cast<Eigen::Index>(i) * d).dot(problem.points[i].normal);
    if (lambda > 1e-14 * force.norm()) continue;
    at.points[i].status = Status::open;
    at.points[i].away = at.points[i].smooth = true;
  }
  clear_cache();
  factor(problem, at, solution);
  clear_cache();
  return !solution.unsupported || std::ranges::any_of(at.points, [](const PointResidual<d>& point) {
    return point.status == Status::slip && !point.smooth;
  });
}

#define WARMSLIP_INSTANTIATE(d)                                                                            \
  template bool ContactSolver<d>::newton_with_spring(const ContactProblem<d>&, bool, ContactSolution<d>&); \
  template void ContactSolver<d>::stick_at_one_point(const ContactProblem<d>&, ContactSolution<d>&);       \
  template bool ContactSolver<d>::newton_with_lent_mass(const ContactProblem<d>&, ContactSolution<d>&);    \
  template bool ContactSolver<d>::is_supported(const ContactProblem<d>&, ContactSolution<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
