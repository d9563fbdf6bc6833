#include "warmslip/contact_solver.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>

namespace warmslip {
namespace {

// Whether statuses alone make the tangent.
template <int d>
bool by_status(const ContactProblem<d>& problem) {
  return d == 2 && std::all_of(problem.laws.begin(), problem.laws.end(),
                               [](const ContactLaw& law) { return law.piecewise_linear(); });
}

}  // namespace

template <int d>
double law_residual(const ContactProblem<d>& problem, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity,
                    double* floor) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  double largest = 0, fastest = 0, rounding = 0, widest = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const auto at = static_cast<Eigen::Index>(i) * d;
    const Point<d> f = force.template segment<d>(at), w = velocity.template segment<d>(at),
                   free = problem.free.template segment<d>(at);
    const double r = point.penetration + problem.step * w.dot(point.normal);
    const double speed = (w - w.dot(point.normal) * point.normal).norm();
    largest = std::max({largest, f.norm(), point.weight * law.compliance.pressure(r),
                        point.weight * law.friction.bound(0, speed).value});  // the last: borne without pressure
    widest = std::max(widest, point.weight * law.bound(r, speed).value);
    fastest = std::max({fastest, free.norm(), w.norm()});
    // the velocity is what the contact force leaves of the free one
    const auto along = [&](const Point<d>& v) { return v.cwiseAbs().dot(point.normal.cwiseAbs()); };
    const double terms = along(point.displacement) + std::abs(point.gap) + problem.step * (along(w) + along(free));
    const double blur =
        4 * eps * terms;  // what rounding makes of r; a point that is open all the same has no part in it
    if (r > -blur) rounding = std::max(rounding, point.weight * law.compliance.tangent(std::max(r, 0.0) + blur) * blur);
  }
  *floor = std::numeric_limits<double>::infinity();
  if (!force.allFinite() || !std::isfinite(largest) || !std::isfinite(fastest))
    return std::numeric_limits<double>::infinity();
  if (largest <= rounding) {  // no contact force that rounding would let one tell from none: is that small?
    *floor = problem.scale > 0 ? rounding / problem.scale : 0;  // a body at rest has nothing to be compared with
    return 0;
  }
  *floor = rounding / largest;
  const double bound_scale = widest > 0 ? widest : largest;
  double worst = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const auto at = static_cast<Eigen::Index>(i) * d;
    const Point<d> f = force.template segment<d>(at), w = velocity.template segment<d>(at);
    const double r = point.penetration + problem.step * w.dot(point.normal);
    const Point<d> f_tau = f - f.dot(point.normal) * point.normal, w_tau = w - w.dot(point.normal) * point.normal;
    const double bound = point.weight * law.bound(r, w_tau.norm()).value;
    const FrictionDefect defect = friction_defect<d>(law.friction, bound, f_tau, w_tau);
    worst = std::max({worst, std::abs(f.dot(point.normal) - point.weight * law.compliance.pressure(r)) / largest,
                      defect.force / bound_scale, fastest > 0 ? defect.power / (bound_scale * fastest) : 0.0});
  }
  return worst;
}

template <int d>
struct ContactSolver<d>::Linearisation {
  Eigen::VectorXd velocity, value;
  std::vector<PointResidual<d>> points;
  std::vector<int> key;  // what the tangent depends on
};

template <int d>
ContactSolver<d>::ContactSolver(Eigen::MatrixXd compliance, ContactOptions options)
    : compliance_(std::move(compliance)), options_(options) {
  if (compliance_.rows() != compliance_.cols() || compliance_.rows() % d != 0)
    throw std::invalid_argument("the compliance must be square with d rows a contact point");
  reach_ = compliance_.cwiseAbs().rowwise().sum();
  spectral_ = compliance_.size() ? reach_.maxCoeff() : 0;
}

template <int d>
typename ContactSolver<d>::Linearisation ContactSolver<d>::linearise(const ContactProblem<d>& problem,
                                                                     const Eigen::VectorXd& force) const {
  Linearisation at;
  at.velocity = problem.free;
  at.velocity.noalias() -= compliance_ * force;
  at.value.resize(force.size());
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Tensor2<d> own = compliance_.template block<d, d>(row, row);
    const Point<d>& nu = point.normal;
    const double normal = nu.dot(own * nu);
    // rows in units of force, of order one in the force whatever the stiffness
    const double stiffness =
        law.compliance.scale(point.penetration + problem.step * problem.free.template segment<d>(row).dot(nu));
    // a law of the user's may be beyond doubles where no contact stops the body; any scale will do
    const double alpha = std::isfinite(stiffness) ? 1 / (1 + point.weight * stiffness * problem.step * normal) : 1;
    // force per velocity when the neighbours move along; the point's own compliance alone makes Newton cycle far more
    // often
    const double beta = 1 / std::max(reach_.template segment<d>(row).maxCoeff(), 1e-300);
    at.points.push_back(residual<d>(law, point, problem.step, alpha, beta, force.template segment<d>(row),
                                    at.velocity.template segment<d>(row)));
    at.value.template segment<d>(row) = at.points.back().value;
    at.key.push_back(at.points.back().key());
  }
  return at;
}

template <int d>
void ContactSolver<d>::factor(const ContactProblem<d>& problem, const Linearisation& at, ContactSolution<d>& solution) {
  if (by_status(problem) && at.key == factored_) return;  // same statuses, same tangent
  closed_.clear();
  for (std::size_t i = 0; i < at.points.size(); ++i)
    if (at.points[i].status != Status::open)
      for (int c = 0; c < d; ++c) closed_.push_back(static_cast<Eigen::Index>(i) * d + c);
  Eigen::MatrixXd tangent = compliance_(closed_, closed_);
  for (std::size_t j = 0; j < closed_.size(); j += d) {
    const auto row = static_cast<Eigen::Index>(j);
    const auto i = static_cast<std::size_t>(closed_[j] / d);
    tangent.template middleRows<d>(row) = (-at.points[i].by_velocity * tangent.template middleRows<d>(row)).eval();
    tangent.template block<d, d>(row, row) += at.points[i].by_force;
    // Gauss points outnumber nodes: sticking ones share their force arbitrarily, and this picks the nearest share.
    // The residual is untouched, so the answer is not regularised.
    if (at.points[i].status == Status::stick && options_.proximal > 0) {
      const Point<d>& nu = problem.points[i].normal;
      tangent.template block<d, d>(row, row) += options_.proximal * (Tensor2<d>::Identity() - nu * nu.transpose());
    }
  }
  tangent_.compute(tangent);
  factored_ = at.key;
  ++solution.factorizations;
}

// The Newton direction: an open point drops its force at once, the closed ones share a dense system.
template <int d>
Eigen::VectorXd ContactSolver<d>::direction(const Linearisation& at, const Eigen::VectorXd& force) const {
  Eigen::VectorXd out = -force;
  out(closed_).setZero();
  Eigen::VectorXd right = -at.value(closed_);
  if (!out.isZero(0)) {
    const Eigen::VectorXd change = compliance_ * out;  // of minus the velocities
    for (std::size_t j = 0; j < closed_.size(); j += d)
      right.template segment<d>(static_cast<Eigen::Index>(j)) +=
          at.points[static_cast<std::size_t>(closed_[j] / d)].by_velocity * change.template segment<d>(closed_[j]);
  }
  if (!closed_.empty()) {
    right = tangent_.solve(right);
    out(closed_) = right;
  }
  return out;
}

template <int d>
bool ContactSolver<d>::accept(const ContactProblem<d>& problem, ContactSolution<d>& solution) const {
  solution.law_residual = law_residual(problem, solution.force, solution.velocity, &solution.floor);
  return solution.law_residual <= options_.tolerance + solution.floor;
}

template <int d>
bool ContactSolver<d>::newton(const ContactProblem<d>& problem, bool line_search, ContactSolution<d>& solution) {
  Linearisation at = linearise(problem, solution.force);
  std::set<std::vector<int>> seen;
  for (int step = 0;; ++step) {
    solution.velocity = at.velocity;
    if (accept(problem, solution)) break;
    if (step == options_.newton_steps) return false;
    // the same statuses once more, after others: an undamped iteration would cycle for ever
    if (by_status(problem) && !line_search && at.key != factored_ && !seen.insert(at.key).second) return false;
    factor(problem, at, solution);
    const Eigen::VectorXd change = direction(at, solution.force);
    if (!change.allFinite()) return false;
    ++solution.iterations;
    const double before = at.value.norm();
    double length = 1;
    for (;; length /= 2) {
      Linearisation next = linearise(problem, solution.force + length * change);
      if (!line_search || next.value.norm() <= (1 - 1e-4 * length) * before || length < 1e-4) {
        solution.force += length * change;
        at = std::move(next);
        break;
      }
    }
  }
  solution.status.clear();
  for (const auto& point : at.points) solution.status.push_back(point.status);
  return true;
}

// One Newton step more, where it does no harm. The law's tolerance lets a point that sticks creep along with its force,
// and whoever asks which points are at rest would find it slipping.
template <int d>
void ContactSolver<d>::polish(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const Linearisation at = linearise(problem, solution.force);
  factor(problem, at, solution);
  ContactSolution<d> finer = solution;
  finer.force += direction(at, solution.force);
  const Linearisation there = linearise(problem, finer.force);
  finer.velocity = there.velocity;
  if (!accept(problem, finer) || finer.law_residual > solution.law_residual) return;
  for (std::size_t i = 0; i < there.points.size(); ++i) finer.status[i] = there.points[i].status;
  ++finer.iterations;
  solution = std::move(finer);
}

// Thresholds frozen, the step is convex: minimise 1/2 l.C l - l.free plus the law's conjugate by accelerated proximal
// gradients, move the thresholds, repeat; Newton finishes from there. Slow, and indifferent to stiffness and statuses.
template <int d>
bool ContactSolver<d>::fixed_point(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  for (const ContactLaw& law : problem.laws)  // smooth: no threshold to freeze
    if (law.friction.regularisation > 0) return false;
  const double rate = 1 / spectral_, k = problem.step;
  // lambda = weight p_nu(r) with r = penetration + k (z - lambda) / rate: falls on the right, rises on the left
  const auto normal_force = [&](const ContactPoint<d>& point, const NormalCompliance& law, double z) {
    if (law.linear()) {
      const double spring = point.weight * law.stiffness * k;
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
  Eigen::VectorXd force = solution.force, momentum = force, bounds(static_cast<Eigen::Index>(problem.points.size()));
  Eigen::VectorXd velocity = problem.free;
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
      velocity = problem.free - compliance_ * force;
      for (std::size_t i = 0; i < problem.points.size(); ++i) bounds[static_cast<Eigen::Index>(i)] = threshold(i);
      momentum = force;
      inertia = 1;
    }
    const Eigen::VectorXd next = prox(momentum + rate * (problem.free - compliance_ * momentum), bounds);
    if (!next.allFinite()) return false;
    const double stronger = (1 + std::sqrt(1 + 4 * inertia * inertia)) / 2;
    momentum = next + (inertia - 1) / stronger * (next - force);
    force = next;
    inertia = stronger;
    if (step % 200 == 199) {
      solution.force = force;
      if (newton(problem, false, solution)) return true;
      solution.force = force;  // a law that bends, or ends, has to be approached step by step
      if (!by_status(problem) && newton(problem, true, solution)) return true;
    }
  }
  return false;
}

template <int d>
bool ContactSolver<d>::enumerate(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  const auto count = problem.points.size();
  if (!by_status(problem) || count > static_cast<std::size_t>(options_.enumerate_points)) return false;
  for (const ContactLaw& law : problem.laws)  // a bound that is there without pressure has more statuses
    if (law.friction.cohesion > 0) return false;
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
    const Linearisation at = linearise(problem, solution.force);
    solution.velocity = at.velocity;
    if (!accept(problem, solution)) continue;
    solution.status.clear();
    for (const auto& point : at.points) solution.status.push_back(point.status);
    return true;
  }
  return false;
}

template <int d>
ContactSolution<d> ContactSolver<d>::solve(const ContactProblem<d>& problem, const Eigen::VectorXd& force) {
  ContactSolution<d> solution;
  solution.force = force;
  solution.velocity = problem.free;
  if (!problem.free.allFinite()) return solution;
  const auto attempt = [&](Stage stage, auto&& method) {
    if (solution.converged) return;
    solution.stage = stage;
    solution.converged = method();
    if (!solution.converged && stage != Stage::line_search) solution.force = force;
  };
  attempt(Stage::newton, [&] { return newton(problem, false, solution); });
  attempt(Stage::line_search, [&] { return newton(problem, true, solution); });
  attempt(Stage::fixed_point, [&] { return fixed_point(problem, solution); });
  attempt(Stage::enumeration, [&] { return enumerate(problem, solution); });
  if (solution.converged && options_.proximal > 0) polish(problem, solution);
  return solution;
}

template double law_residual<2>(const ContactProblem<2>&, const Eigen::VectorXd&, const Eigen::VectorXd&, double*);
template double law_residual<3>(const ContactProblem<3>&, const Eigen::VectorXd&, const Eigen::VectorXd&, double*);
template class ContactSolver<2>;
template class ContactSolver<3>;

}  // namespace warmslip
