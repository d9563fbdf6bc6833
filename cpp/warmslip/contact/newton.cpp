// Semismooth Newton on the contact points and the rigid motions: residual, dense tangent, direction, iteration.
#include <algorithm>

#include "warmslip/contact/linearisation.hpp"

namespace warmslip {
namespace {

// An orthonormal basis of the force of a point that Newton's method seeks; the rest of it is known to be 0.
template <int d>
Eigen::Matrix<double, d, Eigen::Dynamic, Eigen::ColMajor, d, d> sought(const PointResidual<d>& at, const Point<d>& nu) {
  if (!at.away && !at.smooth) return Tensor2<d>::Identity();
  if (at.smooth) return nu;
  Eigen::Matrix<double, d, d - 1> across;
  across.col(0) = nu.unitOrthogonal();
  if constexpr (d == 3) across.col(1) = nu.cross(across.col(0));
  return across;
}

constexpr double nearly = 1e-6;  // residuals of the law that may be rounding
constexpr int patience = 15;     // steps in which a small correction may change statuses, or small forces settle

// Eigen's estimate alone is any number where a pivot is 0 exactly.
bool singular(const Eigen::PartialPivLU<Eigen::MatrixXd>& lu) {
  const auto pivots = lu.matrixLU().diagonal().cwiseAbs();
  return !(pivots.minCoeff() > 1e-14 * pivots.maxCoeff() && lu.rcond() > 1e-14);
}

}  // namespace

// The compliance of a point by itself; zero where its motion is given.
template <int d>
PointCompliance ContactSolver<d>::diagonal_block(const ContactProblem<d>& problem, std::size_t i) const {
  const Point<d>& nu = problem.points[i].normal;
  const auto row = static_cast<Eigen::Index>(i) * d;
  Tensor2<d> block = compliance_.template block<d, d>(row, row);
  if (carries_) block += carried_.template middleCols<d>(row);
  const Tensor2<d> tangential = Tensor2<d>::Identity() - nu * nu.transpose();
  const Tensor2<d> across = tangential * block * tangential;
  // of the at most two eigenvalues that are not zero the larger one
  const double half = across.trace() / 2,
               largest =
                   d == 2 ? across.trace() : half + std::sqrt(std::max(0.0, across.squaredNorm() / 2 - half * half));
  // where a support holds the point along its tangent, rounding of the velocity across it is no slip
  const double normal = nu.dot(block * nu), own = largest > 0 && largest < 1e-9 * normal ? normal : largest;
  return {problem.step * normal, own / tangential_scale_};
}

// A point whose motion is given: its force follows from the law, and moves nothing.
template <int d>
void ContactSolver<d>::prescribed(const ContactProblem<d>& problem, Linearisation& at, std::size_t i) const {
  const ContactPoint<d>& point = problem.points[i];
  const ContactLaw& law = problem.law(i);
  const auto row = static_cast<Eigen::Index>(i) * d;
  const Point<d> w = at.velocity.template segment<d>(row), slip = w - w.dot(point.normal) * point.normal;
  const double r = point.penetration + problem.step * w.dot(point.normal), speed = slip.norm();
  const double pressure = law.compliance.rigid() ? 0 : law.compliance.pressure(r);
  const double bound = point.weight * law.friction.bound(pressure, speed).value;
  const double smeared = std::hypot(speed, law.friction.regularisation);
  Point<d> force = point.weight * pressure * point.normal;
  if (smeared > 0) force += bound / smeared * slip;
  PointResidual<d>& out = at.points[i];
  out.slip_sign = 0;
  out.touching = r > 0;
  out.pressed = pressure > 0;
  out.value = at.value.template segment<d>(row) - force;
  out.by_force = Tensor2<d>::Identity();
  out.by_velocity.setZero();
  out.status = bound <= 0 && r <= 0 ? Status::open : speed > 0 ? Status::slip : Status::stick;
  out.away = out.smooth = true;
  at.value.template segment<d>(row) = out.value;
}

// Where the points move under the added forces and the rigid motions; the value holds all forces and the rigid balance.
template <int d>
typename ContactSolver<d>::Linearisation ContactSolver<d>::motion(const ContactProblem<d>& problem,
                                                                  const Eigen::VectorXd& added,
                                                                  const Eigen::VectorXd& rigid) const {
  Linearisation at;
  const Eigen::VectorXd force = total(problem, added);
  at.velocity = known_velocity(problem);
  at.velocity.noalias() -= compliance_ * added;
  at.value.resize(force.size() + rigid_.count());
  at.value.head(force.size()) = force;
  if (rigid_.count() > 0) {
    at.velocity.noalias() += rigid_unit_ * rigid_.motions * rigid;
    at.value.tail(rigid_.count()) =
        rigid_.loads.transpose() * added + rigid_unit_ * rigid_.inertia * rigid - problem.rigid;
  }
  return at;
}

// The law's residual at the velocities of `at` and the forces in its value, with own compliances that are so many times
// smaller.
template <int d>
void ContactSolver<d>::apply_law(const ContactProblem<d>& problem, double firmness, Linearisation& at) const {
  at.points.resize(problem.points.size());
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i) * d;
    const PointCompliance scales = diagonal_block(problem, i);
    if (scales.normal > 0 && scales.tangential > 0) {
      at.points[i] = residual<d>(problem.law(i), problem.points[i], problem.step,
                                 {scales.normal / firmness, scales.tangential / firmness},
                                 at.value.template segment<d>(row), at.velocity.template segment<d>(row));
      at.value.template segment<d>(row) = at.points[i].value;
    } else {
      prescribed(problem, at, i);
    }
    at.key.push_back(at.points[i].key());
  }
}

template <int d>
typename ContactSolver<d>::Linearisation ContactSolver<d>::linearise(const ContactProblem<d>& problem,
                                                                     const Eigen::VectorXd& added,
                                                                     const Eigen::VectorXd& rigid) const {
  Linearisation at = motion(problem, added, rigid);
  apply_law(problem, 1, at);
  return at;
}

template <int d>
void ContactSolver<d>::factor(const ContactProblem<d>& problem, const Linearisation& at, ContactSolution<d>& solution) {
  solution.unsupported = unsupported_;
  if (tangent_depends_on_status_only(problem) && at.key == tangent_status_) return;  // same statuses, same tangent
  tangent_status_.clear();  // until it is whole: memory may run out on the way
  active_points_.clear();
  Eigen::Index n = 0;
  for (std::size_t i = 0; i < at.points.size(); ++i) {
    if (at.points[i].away && at.points[i].smooth) continue;
    active_points_.push_back({static_cast<Eigen::Index>(i) * d, n, sought<d>(at.points[i], problem.points[i].normal)});
    n += active_points_.back().size();
  }
  const Eigen::Index m = rigid_.count();
  Eigen::MatrixXd tangent(n + m, n + m);
  const auto at_block = [&](const ActivePoint& row, const ActivePoint& column) {
    return tangent.block(row.at, column.at, row.size(), column.size());
  };
  for (const ActivePoint& row : active_points_) {
    const PointResidual<d>& point = at.points[static_cast<std::size_t>(row.row / d)];
    for (const ActivePoint& column : active_points_) {
      const auto give = compliance_.template block<d, d>(row.row, column.row);
      if (row.size() == d && column.size() == d)  // of fixed sizes, and quick
        tangent.template block<d, d>(row.at, column.at).noalias() = -point.by_velocity * give;
      else
        at_block(row, column) = -(row.basis.transpose() * point.by_velocity) * (give * column.basis);
    }
    at_block(row, row) += row.basis.transpose() * (point.by_force + shared(problem, point, row.row / d)) * row.basis;
    for (Eigen::Index j = 0; j < m; ++j) {
      const Point<d> motion = rigid_.motions.col(j).template segment<d>(row.row),
                     load = rigid_.loads.col(j).template segment<d>(row.row);
      tangent.col(n + j).segment(row.at, row.size()) =
          rigid_unit_ * row.basis.transpose() * (point.by_velocity * motion);
      tangent.row(n + j).segment(row.at, row.size()) = load.transpose() * row.basis;
    }
  }
  tangent.bottomRightCorner(m, m) = rigid_unit_ * rigid_.inertia;
  tangent.bottomRightCorner(m, m).diagonal().array() += lent_mass_;
  // allocated again: Eigen's matrices lose their memory when they grow and cannot
  if (tangent_.rows() != n + m) tangent_ = Eigen::PartialPivLU<Eigen::MatrixXd>(n + m);
  if (n + m > 0) tangent_.compute(tangent);
  // without mass the points in contact alone hold the body
  const auto weightless = [&] {
    Eigen::MatrixXd out = tangent;
    out.bottomRightCorner(m, m) = resisted_;
    return Eigen::PartialPivLU<Eigen::MatrixXd>(out);
  };
  solution.unsupported = unsupported_ = m > 0 && !massive_ && singular(resisted_.isZero(0) ? tangent_ : weightless());
  if (spring_ > 0) {
    if (singular(weightless())) {
      tangent.bottomRightCorner(m, m).diagonal().array() += rigid_unit_ * spring_;
      tangent_.compute(tangent);  // the load then moves the body until something holds it
    }
  }
  tangent_status_ = at.key;
  ++solution.factorizations;
}

// Gauss points outnumber nodes: those that stick, or are pressed on a rigid foundation, share their force arbitrarily,
// and this picks the nearest share. The residual is untouched, so the answer is not regularised.
template <int d>
Tensor2<d> ContactSolver<d>::shared(const ContactProblem<d>& problem, const PointResidual<d>& at,
                                    Eigen::Index point) const {
  const auto i = static_cast<std::size_t>(point);
  const Point<d>& nu = problem.points[i].normal;
  const Tensor2<d> normal = nu * nu.transpose();
  Tensor2<d> out = Tensor2<d>::Zero();
  if (options_.proximal <= 0) return out;
  const ContactLaw& law = problem.law(i);
  if (at.status == Status::stick && law.friction.regularisation == 0)
    out += options_.proximal * (Tensor2<d>::Identity() - normal);
  const double share = law.compliance.rigid() ? options_.proximal : stiff_proximal_;
  if (at.touching) out += std::max(0.0, share - nu.dot(at.by_force * nu)) * normal;
  return out;
}

// The Newton direction of forces and rigid motions: what is known to be 0 of a force, the pressure of a point that is
// away and the tangential force of one without friction, becomes so at once; the rest shares a dense system. A body
// that nothing else holds would else slide by rounding of a tangential force, and a pressure of rounding be taken for
// contact.
template <int d>
Eigen::VectorXd ContactSolver<d>::direction(const Linearisation& at) const {
  const Eigen::Index m = rigid_.count(), all = compliance_.rows(), n = tangent_.rows() - m;
  Eigen::VectorXd out = -at.value;
  for (const ActivePoint& here : active_points_) {
    auto rest = out.template segment<d>(here.row);
    if (here.size() == d)
      rest.setZero();
    else
      rest -= here.basis * (here.basis.transpose() * rest).eval();
  }
  out.tail(m).setZero();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n + m);
  const bool any = !out.isZero(0);
  const Eigen::VectorXd change = any ? compliance_ * out.head(all) : Eigen::VectorXd();  // of minus the velocities
  for (const ActivePoint& here : active_points_) {
    const PointResidual<d>& point = at.points[static_cast<std::size_t>(here.row / d)];
    Point<d> rest = -at.value.template segment<d>(here.row);
    if (any) rest += point.by_velocity * change.template segment<d>(here.row);
    right.segment(here.at, here.size()) = here.basis.transpose() * rest;
  }
  right.tail(m) = -at.value.tail(m);
  if (any && m > 0) right.tail(m) -= rigid_.loads.transpose() * out.head(all);
  if (n + m > 0) right = tangent_.solve(right);
  for (const ActivePoint& here : active_points_)
    out.template segment<d>(here.row) += here.basis * right.segment(here.at, here.size());
  out.tail(m) = right.tail(m);
  return out;
}

template <int d>
bool ContactSolver<d>::accept(const ContactProblem<d>& problem, ContactSolution<d>& solution, double rest) const {
  solution.law_residual = law_residual(problem, solution.force, solution.velocity);
  if (solution.law_residual <= options_.tolerance) return true;
  if (!terms_cancel_ || !(solution.law_residual <= nearly || rest <= 1e-13 * solution.force.norm())) return false;
  // forces on both sides of a body that springs hardly hold, or in a corner: each moves it, and together they do not
  const Eigen::VectorXd moved = compliance_.cwiseAbs() * solution.force.cwiseAbs();
  const Point<d> terms = problem.step * moved.reshaped(d, moved.size() / d).rowwise().maxCoeff();
  solution.law_residual = law_residual(problem, solution.force, solution.velocity, terms);
  return solution.law_residual <= options_.tolerance;
}

template <int d>
bool ContactSolver<d>::newton(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution) {
  Linearisation at = linearise(problem, solution.added, solution.rigid);
  const Eigen::Index all = compliance_.rows();
  ContactSolution<d> best;  // the tolerance is met: one step more may reach round-off
  double best_rest = 0;     // what its forces leave of their own equations
  const double rounding = 1e-2 * options_.tolerance;
  bool best_settled = false;  // whether that is little beside them
  int best_step = 0;
  std::vector<int> tried;  // statuses of the step before
  for (int step = 0;; ++step) {
    solution.velocity = at.velocity;
    solution.force = total(problem, solution.added);
    // the motions that are solved for apart are linear and exact after a full step
    const double unbalanced = rigid_.count() > 0 ? at.value.tail(rigid_.count()).cwiseAbs().maxCoeff() : 0;
    const double forces =
        rigid_.count() > 0 ? problem.rigid.cwiseAbs().maxCoeff() + solution.force.cwiseAbs().sum() : 0;
    // a correction of what is known is wanted, however little it is, with the statuses it leads to, but not another
    // solution of a law that has several
    const bool wanted = (step == 0 || (step < patience && at.key != tried)) && problem.known_force.size() > 0 &&
                        at.value.head(all).norm() <= 1e-6 * solution.force.norm();
    tried = at.key;
    if (!wanted && unbalanced <= options_.tolerance * forces && accept(problem, solution, at.value.head(all).norm())) {
      solution.status.clear();
      for (const auto& point : at.points) solution.status.push_back(point.status);
      // beside large motions the law's residual says little of small forces
      const double rest = at.value.head(all).norm();
      const bool settled = rest <= 1e-10 * solution.force.norm(), nearer = rest < 0.5 * best_rest;
      const bool helped = !best.converged || (settled ? solution.law_residual < 0.9 * best.law_residual : nearer);
      if (!best.converged || solution.law_residual < best.law_residual || nearer) {
        best = solution;
        best_rest = rest;
        best_settled = settled;
        best_step = step;
      }
      best.converged = true;
      if (!helped || (settled && solution.law_residual <= rounding)) break;
    } else if (best.converged && (best_settled || best.law_residual <= rounding || step >= best_step + patience)) {
      break;
    }
    if (step >= options_.newton_steps) {
      if (best.converged) break;
      return false;
    }
    factor(problem, at, solution);
    const Eigen::VectorXd change = direction(at);
    if (!change.allFinite() || (solution.unsupported && spring_ == 0)) {
      tangent_status_.clear();
      if (best.converged) break;
      return false;
    }
    ++solution.iterations;
    const double before = at.value.norm();
    for (double length = 1;; length /= 2) {
      Linearisation next = linearise(problem, solution.added + length * change.head(all),
                                     solution.rigid + length * change.tail(rigid_.count()));
      if (!line_search || next.value.norm() <= (1 - 1e-4 * length) * before || length < 1e-4) {
        solution.added += length * change.head(all);
        solution.rigid += length * change.tail(rigid_.count());
        at = std::move(next);
        break;
      }
    }
  }
  best.iterations = solution.iterations;
  best.factorizations = solution.factorizations;
  solution = std::move(best);
  return true;
}

// One Newton step more, where it does no harm. The law's tolerance lets a point that sticks creep along with its force,
// and whoever asks which points are at rest would find it slipping.
template <int d>
void ContactSolver<d>::polish(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const Linearisation at = linearise(problem, solution.added, solution.rigid);
  factor(problem, at, solution);
  ContactSolution<d> finer = solution;
  const Eigen::VectorXd change = direction(at);
  finer.added += change.head(compliance_.rows());
  finer.force = total(problem, finer.added);
  finer.rigid += change.tail(rigid_.count());
  const Linearisation there = linearise(problem, finer.added, finer.rigid);
  finer.velocity = there.velocity;
  if (!accept(problem, finer) || finer.law_residual > solution.law_residual) return;
  for (std::size_t i = 0; i < there.points.size(); ++i) finer.status[i] = there.points[i].status;
  ++finer.iterations;
  solution = std::move(finer);
}

template <int d>
bool ContactSolver<d>::respond(const ContactProblem<d>& problem, const Eigen::VectorXd& change,
                               const std::vector<bool>& resting, ContactSolution<d>& solution) {
  const Eigen::Index all = compliance_.rows();
  Linearisation at =
      linearise(problem, Eigen::VectorXd::Zero(all), Eigen::VectorXd(Eigen::VectorXd::Zero(rigid_.count())));
  for (std::size_t i = 0; i < resting.size(); ++i) {
    if (!resting[i]) continue;
    PointResidual<d>& point = at.points[i];
    const Point<d>& nu = problem.points[i].normal;
    const Tensor2<d> normal = nu * nu.transpose();
    point.by_force = (normal * point.by_force * normal).eval();
    point.by_velocity = (normal * point.by_velocity * normal).eval() -
                        1 / diagonal_block(problem, i).tangential * (Tensor2<d>::Identity() - normal);
    point.status = Status::stick;
    at.key[i] = point.key();
  }
  factor(problem, at, solution);
  for (Eigen::Index row = 0; row < all; row += d)
    at.value.template segment<d>(row) =
        at.points[static_cast<std::size_t>(row / d)].by_velocity * change.template segment<d>(row);
  at.value.tail(rigid_.count()) = -problem.rigid;
  const Eigen::VectorXd response = direction(at);
  if (!resting.empty()) clear_cache();  // no later step is to find a tangent of statuses that were supposed
  if (!response.allFinite() || solution.unsupported) return false;
  solution.added = response.head(all);
  solution.force = problem.known_force + solution.added;
  solution.rigid = rigid_unit_ * response.tail(rigid_.count());
  return true;
}

#define WARMSLIP_INSTANTIATE(d)                                                                                       \
  template PointCompliance ContactSolver<d>::diagonal_block(const ContactProblem<d>&, std::size_t) const;             \
  template ContactSolver<d>::Linearisation ContactSolver<d>::motion(const ContactProblem<d>&, const Eigen::VectorXd&, \
                                                                    const Eigen::VectorXd&) const;                    \
  template void ContactSolver<d>::apply_law(const ContactProblem<d>&, double, Linearisation&) const;                  \
  template ContactSolver<d>::Linearisation ContactSolver<d>::linearise(                                               \
      const ContactProblem<d>&, const Eigen::VectorXd&, const Eigen::VectorXd&) const;                                \
  template void ContactSolver<d>::factor(const ContactProblem<d>&, const Linearisation&, ContactSolution<d>&);        \
  template Eigen::VectorXd ContactSolver<d>::direction(const Linearisation&) const;                                   \
  template bool ContactSolver<d>::accept(const ContactProblem<d>&, ContactSolution<d>&, double) const;                \
  template bool ContactSolver<d>::newton(const ContactProblem<d>&, bool, ContactSolution<d>&);                        \
  template void ContactSolver<d>::polish(const ContactProblem<d>&, ContactSolution<d>&);                              \
  template bool ContactSolver<d>::respond(const ContactProblem<d>&, const Eigen::VectorXd&, const std::vector<bool>&, \
                                          ContactSolution<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
