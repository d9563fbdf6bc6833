// What is tried, in which order: Newton's method, then its safeguards.
#include <algorithm>
#include <stdexcept>

#include "warmslip/contact/linearisation.hpp"

namespace warmslip {
namespace {

constexpr int few_steps = 15;  // before other scales are tried

// Whether all that friction does is to resist slip.
template <int d>
bool slips_alone(const ContactProblem<d>& problem, const ContactSolution<d>& solution) {
  bool rubs = false;
  for (std::size_t i = 0; i < solution.status.size(); ++i) {
    if (solution.status[i] == Status::stick) return false;
    const Point<d> force = solution.force.template segment<d>(static_cast<Eigen::Index>(i) * d),
                   nu = problem.points[i].normal;
    rubs = rubs || (force - force.dot(nu) * nu).norm() > 1e-14 * solution.force.norm();
  }
  return rubs;
}

}  // namespace

template <int d>
ContactSolver<d>::ContactSolver(Eigen::MatrixXd compliance, ContactOptions options, RigidCoupling rigid)
    : compliance_(std::move(compliance)), options_(options), rigid_(std::move(rigid)) {
  if (compliance_.rows() != compliance_.cols() || compliance_.rows() % d != 0)
    throw std::invalid_argument("the compliance must be square with d rows a contact point");
  if (rigid_.motions.size() == 0) rigid_.motions.resize(compliance_.rows(), rigid_.count());
  if (rigid_.loads.size() == 0) rigid_.loads = rigid_.motions;
  compliance_norm_ = compliance_.size() ? compliance_.cwiseAbs().rowwise().sum().maxCoeff() : 0;
  rigid_unit_ = compliance_norm_ > 0 ? compliance_norm_ : 1;
  carried_ = Eigen::MatrixXd::Zero(d, compliance_.rows());
  find_resisted();
  if (!massive_) return;
  const Eigen::MatrixXd velocities = rigid_.inertia.fullPivLu().solve(rigid_.loads.transpose());
  for (Eigen::Index row = 0; row < compliance_.rows(); row += d)
    carried_.middleCols<d>(row) = rigid_.motions.middleRows<d>(row) * velocities.middleCols<d>(row);
}

// Which motions a mass or a spring resists, however weakly: each counts against its own.
template <int d>
void ContactSolver<d>::find_resisted() {
  const Eigen::Index m = rigid_.count();
  resisted_ = Eigen::MatrixXd::Zero(m, m);
  if (m == 0 || rigid_.inertia.isZero(0)) return;
  const Eigen::VectorXd own =
      rigid_.inertia.diagonal().unaryExpr([](double h) { return h > 0 ? 1 / std::sqrt(h) : 0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> found(own.asDiagonal() * rigid_.inertia * own.asDiagonal());
  const Eigen::VectorXd counts = found.eigenvalues().unaryExpr([](double one) { return one > 1e-12 ? 1.0 : 0.0; });
  massive_ = counts.minCoeff() > 0;
  resisted_ = found.eigenvectors() * counts.asDiagonal() * found.eigenvectors().transpose();
}

template <int d>
ContactSolution<d> ContactSolver<d>::solve(const ContactProblem<d>& problem, const Eigen::VectorXd& force) {
  ContactSolution<d> solution;
  const Eigen::VectorXd guess = beyond_known(problem, force),
                        none = beyond_known<d>(problem, Eigen::VectorXd::Zero(force.size()));
  solution.force = force;
  solution.added = guess;
  solution.velocity = problem.free;
  solution.rigid = Eigen::VectorXd::Zero(rigid_.count());
  if (!problem.free.allFinite()) return solution;
  const bool massive = massive_;
  // the rigid motions under the forces that are there: their equations then hold in every iterate
  const auto move = [&] {
    solution.rigid.setZero();
    if (massive)
      solution.rigid =
          (rigid_unit_ * rigid_.inertia).fullPivLu().solve(problem.rigid - rigid_.loads.transpose() * solution.added);
  };
  const auto attempt = [&](Stage stage, auto&& method) {
    if (solution.converged) return;
    solution.stage = stage;
    solution.converged = method();
    if (!solution.converged) solution.added = guess;
  };
  // a body that lies on the foundation gives way by its deformation, one that hits it as a whole
  const auto moving = [&](bool carries, int steps) {
    const Trial trial(*this);
    carries_ = carries;
    options_.newton_steps = steps;
    move();
    return newton(problem, true, solution);
  };
  attempt(Stage::newton, [&] {
    move();
    return massive && force.isZero(0) ? moving(false, few_steps) : newton(problem, true, solution);
  });
  if (massive)
    for (const auto& [carries, afresh] : {std::pair{true, false}, std::pair{true, true}, std::pair{false, true}})
      attempt(Stage::restart, [&, carries = carries, afresh = afresh] {
        if (afresh) solution.added = none;
        return moving(carries, options_.newton_steps);
      });
  if (rigid_.count() > 0)  // it may have to come to the foundation first
    for (const bool line_search : {true, false})
      attempt(Stage::restart, [&] { return newton_with_spring(problem, line_search, solution); });
  if (rigid_.count() > 0 && !massive && !lent_)
    attempt(Stage::restart, [&] { return newton_with_lent_mass(problem, solution); });
  attempt(Stage::restart, [&] { return newton(problem, false, solution); });
  // again from no force, with other scales of the tangential rows
  for (const double tangential_scale : {1.0, 0.1, 10.0, 0.01})
    attempt(Stage::restart, [&] {
      const Trial trial(*this);
      tangential_scale_ = tangential_scale;
      stiff_proximal_ = options_.proximal;
      solution.added = none;
      move();
      return newton(problem, true, solution);
    });
  attempt(Stage::restart, [&] { return kept_coefficients(problem, solution); });
  attempt(Stage::tresca_fixed_point, [&] {
    const Trial trial(*this);
    const bool unsupported = solution.unsupported;
    move();
    if (tresca_fixed_point(problem, solution) && is_supported(problem, solution)) return true;
    solution.unsupported = unsupported || solution.unsupported;
    return false;
  });
  attempt(Stage::enumeration, [&] { return enumerate(problem, solution); });
  attempt(Stage::restart, [&] {
    const Trial trial(*this);
    terms_cancel_ = true;
    move();
    return newton(problem, true, solution);
  });
  if (massive && !lent_ && rigid_unit_ * rigid_.inertia.norm() < 1e-12 &&
      (!solution.converged || slips_alone(problem, solution)))
    stick_at_one_point(problem, solution);
  if (solution.converged && options_.proximal > 0) polish(problem, solution);
  if (solution.converged && rigid_.count() > 0 && !massive) {
    factor(problem, linearise(problem, solution.added, solution.rigid), solution);
    solution.undetermined = solution.unsupported;
  }
  solution.unsupported = solution.unsupported && !solution.converged;
  solution.rigid *= rigid_unit_;
  return solution;
}

// Where friction falls with the slip speed: the coefficients of the slip so far are kept, which is a problem of
// Coulomb's, and Newton's method goes on from its solution.
template <int d>
bool ContactSolver<d>::kept_coefficients(const ContactProblem<d>& problem, ContactSolution<d>& solution) {
  ContactProblem<d> kept = problem;
  kept.laws.clear();
  bool falls = false;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    kept.points[i].law = i;
    kept.laws.push_back(problem.law(i));
    falls = falls || (problem.law(i).friction.speed > 0 && !problem.law(i).friction.custom);
    kept.laws[i].friction.speed = 0;
  }
  if (!falls) return false;
  ContactSolution<d> found = solution;
  bool converged = false;
  for (int pass = 0; pass < 50 && !converged; ++pass) {
    clear_cache();
    found = solve(kept, total(problem, found.added));
    solution.iterations += found.iterations;
    solution.factorizations += found.factorizations;
    if (!found.converged) break;
    found.rigid /= rigid_unit_;
    clear_cache();
    ContactSolution<d> finished = found;
    converged = newton(problem, true, finished);
    solution.iterations += finished.iterations - found.iterations;
    if (converged) {
      finished.iterations = solution.iterations;
      finished.factorizations = solution.factorizations;
      finished.stage = solution.stage;
      solution = std::move(finished);
    }
    for (std::size_t i = 0; i < problem.points.size(); ++i) {
      const Friction& falling = problem.law(i).friction;
      const Point<d>&nu = problem.points[i].normal,
            w = found.velocity.template segment<d>(static_cast<Eigen::Index>(i) * d);
      double& coefficient = kept.laws[i].friction.coefficient;
      if (falling.speed > 0 && !falling.custom)
        coefficient += (pass < 10 ? 1 : 0.5) * (falling.at((w - w.dot(nu) * nu).norm()) - coefficient);
    }
  }
  clear_cache();
  return converged;
}

#define WARMSLIP_INSTANTIATE(d)                                                             \
  template ContactSolver<d>::ContactSolver(Eigen::MatrixXd, ContactOptions, RigidCoupling); \
  template ContactSolution<d> ContactSolver<d>::solve(const ContactProblem<d>&, const Eigen::VectorXd&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
