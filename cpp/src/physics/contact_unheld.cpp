// Bodies that nothing but contact holds, and that may have to come to it first.
#include <algorithm>

#include "contact_linearisation.hpp"

namespace warmslip {

// Forces and rigid motions under which all points that can move are pressed and stick: where such a body is to come to
// rest. Points that pull there open in the next step.
template <int d>
void ContactSolver<d>::glue(const ContactProblem<d>& problem, ContactSolution<d>& solution) const {
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    if (const OwnCompliance scales = own(problem, i); scales.normal > 0 && scales.tangential > 0)
      for (int c = 0; c < d; ++c) rows.push_back(static_cast<Eigen::Index>(i) * d + c);
  const auto n = static_cast<Eigen::Index>(rows.size()), m = rigid_.count();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + m, n + m);
  Eigen::VectorXd right(n + m);
  system.topLeftCorner(n, n) = -compliance_(rows, rows);
  system.topRightCorner(n, m) = give_ * rigid_.motions(rows, Eigen::all);
  system.bottomLeftCorner(m, n) = rigid_.loads(rows, Eigen::all).transpose();
  system.bottomRightCorner(m, m) = give_ * rigid_.inertia;
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
bool ContactSolver<d>::approach(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution) {
  double reach = problem.step * problem.free.cwiseAbs().maxCoeff();
  for (const ContactPoint<d>& point : problem.points) reach = std::max(reach, std::abs(point.penetration));
  const Trial trial(*this);
  if (!line_search && reach > 0) leash_ = problem.step * problem.rigid.cwiseAbs().maxCoeff() / reach;
  glue(problem, solution);
  return newton(problem, line_search, solution) && held(problem, solution);
}

// Whether a solution that was found with something else to hold the body is held by the points alone. Where points slip
// with friction, that may leave some room to the body, and this is one of several solutions.
template <int d>
bool ContactSolver<d>::held(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  leash_ = lean_ = 0;
  forget();
  const Linearisation at = linearise(problem, solution.added, solution.rigid);
  factor(problem, at, solution);
  return !solution.unsupported || std::ranges::any_of(at.points, [](const PointResidual<d>& point) {
    return point.status == Status::slip && !point.smooth;
  });
}

#define WARMSLIP_INSTANTIATE(d)                                                                  \
  template bool ContactSolver<d>::approach(const ContactProblem<d>&, bool, ContactSolution<d>&); \
  template bool ContactSolver<d>::held(const ContactProblem<d>&, ContactSolution<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
