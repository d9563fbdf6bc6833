#include "warmslip/stepper.hpp"

#include <algorithm>
#include <ctime>
#include <limits>

namespace warmslip {
namespace {

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Adds the CPU time of its life to `to`.
class Timed {
 public:
  explicit Timed(double& to) : to_(to), begin_(cpu_seconds()) {}
  ~Timed() { to_ += cpu_seconds() - begin_; }
  Timed(const Timed&) = delete;

 private:
  double& to_;
  double begin_;
};

// With R = c M the heat rows divided by c make the coupled matrix symmetric: definite for c > 0 unless the coupling is
// strong, quasi-definite for c < 0 (Vanderbei, SIAM J. Optim. 5, 1995).
template <int d>
std::pair<double, Symmetry> coupled_symmetry(const Material<d>& m) {
  const double expansion = m.expansion.squaredNorm();
  if (expansion == 0) return {1, m.heating.isZero(0) ? Symmetry::positive_definite : Symmetry::general};
  const double c = m.heating.cwiseProduct(m.expansion).sum() / expansion;
  if (c == 0 || (m.heating - c * m.expansion).norm() > 1e-14 * m.heating.norm()) return {1, Symmetry::general};
  return {1 / c, c > 0 ? Symmetry::positive_definite : Symmetry::symmetric};
}

// A step of which nothing is known: its residuals are not numbers.
template <int d>
StepReport<d> not_taken(Outcome outcome) {
  StepReport<d> report;
  report.outcome = outcome;
  Ledger& l = report.ledger;
  for (double* unknown : {&l.energy_residual, &l.heat_residual, &l.force_residual, &l.law_residual, &l.law_floor,
                          &l.energy_floor, &l.force_floor})
    *unknown = std::numeric_limits<double>::quiet_NaN();
  return report;
}

}  // namespace

template <int d>
Stepper<d>::Stepper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                    const ContactSurface<d>& surface, StepperOptions options)
    : layout_(layout),
      problem_(problem),
      operators_(operators),
      surface_(surface),
      options_(options),
      books_(layout, problem, operators, surface) {
  if (!(options.k > 0) || !std::isfinite(options.k))
    throw std::invalid_argument("the time step must be positive and finite");
  const Timed timed(cost_.setup_seconds);
  if (options.coupling == Coupling::monolithic) {
    auto [scale, symmetry] = coupled_symmetry(problem.material);
    coupled_scale_ = scale;
    const MatHandle a = coupled_matrix(layout, problem, operators, options.k, scale);
    momentum_ = factor(a, surface.unknowns(d + 1), symmetry, d + 1, "coupled", options.backend);
    coupled_right_ = layout.vector(d + 1);
    coupled_ = layout.vector(d + 1);
  } else {
    const MatHandle a = momentum_matrix(layout, problem, operators, options.k), h = heat_matrix(operators, options.k);
    momentum_ = factor(a, surface.unknowns(d), Symmetry::positive_definite, d, "momentum", options.backend);
    const bool conducts = problem.material.conductivity.isApprox(problem.material.conductivity.transpose());
    heat_ = factor(h, {}, conducts ? Symmetry::positive_definite : Symmetry::general, 1, "heat", options.backend);
  }
  ContactOptions contact = options.contact;
  // more contact points than nodes: sticking forces are shared arbitrarily, see ContactSolver::factor
  if (surface.points() > surface.nodes()) contact.proximal = 1e-8;
  try {
    contact_ = std::make_unique<ContactSolver<d>>(surface.at_points(momentum_->compliance()), contact);
  } catch (const SolveFailed& failure) {  // before the first step: refused
    throw std::invalid_argument(failure.what());
  }
  for (Level* level : {&now_, &next_}) {
    level->u = layout.vector(d);
    level->w = layout.vector(d);
    level->theta = layout.vector(1);
    level->mass_w = layout.vector(d);
    level->elastic_u = layout.vector(d);
    level->mass_theta = layout.vector(1);
    level->expansion_theta = layout.vector(d);
    level->heating_w = layout.vector(1);
  }
  for (VecHandle* v : {&momentum_right_, &correction_w_}) *v = layout.vector(d);
  for (VecHandle* v : {&heat_right_, &correction_theta_}) *v = layout.vector(1);
  contact_force_ = Eigen::VectorXd::Zero(surface.points() * d);
  cost_.factorizations = heat_ ? 2 : 1;
  cost_.factor_bytes = momentum_->bytes() + (heat_ ? heat_->bytes() : 0);
}

template <int d>
void Stepper<d>::products(Level& level) const {
  WARMSLIP_PETSC(MatMult(operators_.vector_mass, level.w, level.mass_w));
  WARMSLIP_PETSC(MatMult(operators_.elasticity, level.u, level.elastic_u));
  WARMSLIP_PETSC(MatMult(operators_.mass, level.theta, level.mass_theta));
  WARMSLIP_PETSC(MatMult(operators_.expansion, level.theta, level.expansion_theta));
  WARMSLIP_PETSC(MatMult(operators_.heating, level.w, level.heating_w));
  level.contact_u = surface_.at_points(surface_.nodal_values(level.u));
}

template <int d>
void Stepper<d>::start(Vec u, Vec w, Vec theta, const Eigen::VectorXd& gap, double time) {
  if (gap.size() != surface_.points()) throw std::invalid_argument("the gap needs one value a contact point");
  WARMSLIP_PETSC(VecCopy(u, now_.u));
  WARMSLIP_PETSC(VecCopy(w, now_.w));
  WARMSLIP_PETSC(VecCopy(theta, now_.theta));
  now_.gap = gap;
  time_ = time;
  products(now_);
}

template <int d>
void Stepper<d>::zero(Vec v, const std::vector<PetscInt>& indices) {
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(v, &begin, &end));
  Values values(v);
  for (const PetscInt i : indices) (*values)[i - begin] = 0;
}

// f + rho M w_{n-1} / k - A u_{n-1}
template <int d>
void Stepper<d>::momentum_right_side(const StepLoads& loads, Vec out) {
  WARMSLIP_PETSC(VecCopy(loads.force, out));
  WARMSLIP_PETSC(VecAXPY(out, problem_.material.density / options_.k, now_.mass_w));
  WARMSLIP_PETSC(VecAXPY(out, -1, now_.elastic_u));
}

template <int d>
bool Stepper<d>::solve_contact(const StepLoads& loads, const Eigen::VectorXd& free, const Eigen::VectorXd& guess,
                               ContactSolution<d>& solution) {
  const Timed timed(cost_.contact_seconds);
  ContactProblem<d> problem{problem_.law, options_.k, {}, free, contact_->scale(free)};
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), u = now_.contact_u.segment<d>(i * d);
    problem.points.push_back({nu, surface_.weights()[i], u.dot(nu) - loads.gap[i], u, loads.gap[i]});
  }
  solution = contact_->solve(problem, guess);
  // every rank solved the same small problem; let them agree to the last bit
  MPI_Bcast(solution.force.data(), static_cast<int>(solution.force.size()), MPI_DOUBLE, 0, layout_.comm());
  int converged = solution.converged;
  MPI_Bcast(&converged, 1, MPI_INT, 0, layout_.comm());
  solution.converged = converged != 0;
  cost_.newton_iterations += solution.iterations;
  cost_.dense_factorizations += solution.factorizations;
  return solution.converged;
}

template <int d>
void Stepper<d>::solve_heat(const StepLoads& loads, Vec heating_w, Vec theta) {
  const Timed timed(cost_.heat_seconds);
  WARMSLIP_PETSC(VecCopy(loads.heat, heat_right_));
  WARMSLIP_PETSC(VecAXPY(heat_right_, 1 / options_.k, now_.mass_theta));
  WARMSLIP_PETSC(VecAXPY(heat_right_, 1, heating_w));
  zero(heat_right_, operators_.cooled);
  heat_->solve(heat_right_, theta);
}

template <int d>
void Stepper<d>::join(Vec momentum, Vec heat, Vec coupled) const {
  Values m(momentum), h(heat), c(coupled);
  for (PetscInt i = 0; i < layout_.owned(); ++i) {
    (*c).template segment<d>(i * (d + 1)) = (*m).template segment<d>(i * d);
    (*c)[i * (d + 1) + d] = coupled_scale_ * (*h)[i];
  }
}

template <int d>
void Stepper<d>::split(Vec coupled, Vec w, Vec theta) const {
  Values c(coupled), m(w), t(theta);
  for (PetscInt i = 0; i < layout_.owned(); ++i) {
    (*m).template segment<d>(i * d) = (*c).template segment<d>(i * (d + 1));
    (*t)[i] = (*c)[i * (d + 1) + d];
  }
}

// What follows from the velocity (and, monolithic, from the temperature) of the step: u, theta and the products.
template <int d>
StepInputs Stepper<d>::complete(const StepLoads& loads, const ContactSolution<d>& contact) {
  WARMSLIP_PETSC(VecWAXPY(next_.u, options_.k, next_.w, now_.u));
  next_.gap = loads.gap;
  const bool lagged = options_.coupling == Coupling::lagged, monolithic = options_.coupling == Coupling::monolithic;
  const Vec heating_w = lagged ? now_.heating_w : next_.heating_w;
  if (!monolithic) {
    if (!lagged) WARMSLIP_PETSC(MatMult(operators_.heating, next_.w, next_.heating_w));
    solve_heat(loads, heating_w, next_.theta);
  }
  products(next_);
  const Vec expansion_theta = monolithic ? next_.expansion_theta : now_.expansion_theta;
  return {options_.k, loads.force,   loads.heat, expansion_theta,
          heating_w,  contact.force, free_,      contact_->scale(free_)};
}

// One step of iterative refinement, contact included: the defect is solved for like a load, and the contact problem is
// solved again with the free velocity it corrects. Needed where K is ill-conditioned: large steps on fine meshes.
template <int d>
bool Stepper<d>::refine(const StepLoads& loads, const StepInputs& inputs, ContactSolution<d>& contact) {
  const bool monolithic = options_.coupling == Coupling::monolithic;
  books_.momentum_defect(now_, next_, inputs, momentum_right_);
  if (monolithic) {
    books_.heat_defect(now_, next_, inputs, heat_right_);
    join(momentum_right_, heat_right_, coupled_right_);
  }
  const Eigen::VectorXd correction =
      surface_.at_points(momentum_->reduce(monolithic ? coupled_right_ : momentum_right_));
  const Eigen::VectorXd velocity = surface_.at_points(surface_.nodal_values(next_.w));
  const Eigen::VectorXd before = contact.force;
  free_ = velocity + contact_->compliance() * before + correction;
  ContactSolution<d> again;
  if (!solve_contact(loads, free_, before, again)) return false;
  momentum_->expand(surface_.to_nodes(again.force - before), monolithic ? coupled_ : correction_w_);
  if (monolithic) {
    split(coupled_, correction_w_, correction_theta_);
    WARMSLIP_PETSC(VecAXPY(next_.theta, 1, correction_theta_));
  }
  WARMSLIP_PETSC(VecAXPY(next_.w, 1, correction_w_));
  again.iterations += contact.iterations;
  again.stage = std::max(again.stage, contact.stage);
  contact = std::move(again);
  ++cost_.refinements;
  return true;
}

// Only a step that closes its books becomes the state.
template <int d>
Outcome Stepper<d>::judge(const Ledger& l) const {
  const double bound = options_.identity_bound;
  if (!std::isfinite(l.kinetic + l.elastic + l.contact + l.conducted + l.heat_change)) return Outcome::not_finite;
  if (!(std::max(l.law_floor, l.force_floor) <= options_.floor_bound)) return Outcome::precision_lost;
  const bool closed = l.heat_residual <= bound && l.force_residual <= bound &&
                      l.energy_residual <= bound + l.energy_floor && l.law_residual <= bound + l.law_floor;
  return closed ? Outcome::right : Outcome::identity_violated;
}

template <int d>
StepReport<d> Stepper<d>::advance(const StepLoads& loads) {
  try {
    return attempt(loads);
  } catch (const SolveFailed& failure) {  // on all ranks alike
    StepReport<d> report = not_taken<d>(Outcome::solver_failed);
    report.reason = failure.what();
    return report;
  }
}

template <int d>
StepReport<d> Stepper<d>::attempt(const StepLoads& loads) {
  if (loads.gap.size() != surface_.points()) throw std::invalid_argument("the gap needs one value a contact point");
  const Timed timed(cost_.step_seconds);
  const bool monolithic = options_.coupling == Coupling::monolithic;
  const int solves = momentum_->substitutions() + (heat_ ? heat_->substitutions() : 0);
  StepReport<d> report;
  ContactSolution<d> contact;
  {
    const Timed part(cost_.momentum_seconds);
    momentum_right_side(loads, momentum_right_);
    if (!monolithic) WARMSLIP_PETSC(VecAXPY(momentum_right_, 1, now_.expansion_theta));
    zero(momentum_right_, operators_.clamped);
    if (monolithic) {
      WARMSLIP_PETSC(VecCopy(loads.heat, heat_right_));
      WARMSLIP_PETSC(VecAXPY(heat_right_, 1 / options_.k, now_.mass_theta));
      zero(heat_right_, operators_.cooled);
      join(momentum_right_, heat_right_, coupled_right_);
    }
    free_ = surface_.at_points(momentum_->reduce(monolithic ? coupled_right_ : momentum_right_));
  }
  const bool finite = layout_.sum(free_.allFinite() ? 0.0 : 1.0) == 0;
  if (!finite || !solve_contact(loads, free_, contact_force_, contact)) {
    report = not_taken<d>(finite ? Outcome::contact_not_converged : Outcome::not_finite);
    report.stage = contact.stage;
    report.newton_iterations = contact.iterations;
    if (finite) report.ledger.law_residual = contact.law_residual;
    return report;
  }
  {
    const Timed part(cost_.momentum_seconds);
    momentum_->expand(surface_.to_nodes(contact.force), monolithic ? coupled_ : next_.w);
    if (monolithic) split(coupled_, next_.w, next_.theta);
  }
  const StepInputs inputs = complete(loads, contact);
  report.ledger = books_.close(now_, next_, inputs);
  if (std::max({report.ledger.energy_residual, report.ledger.force_residual,
                monolithic ? report.ledger.heat_residual : 0.0}) > options_.refinement &&
      refine(loads, inputs, contact))
    report.ledger = books_.close(now_, next_, complete(loads, contact));
  report.outcome = judge(report.ledger);
  if (report.outcome == Outcome::precision_lost)
    report.reason =
        report.ledger.law_floor <= options_.floor_bound
            ? "the body moves so far that rounding hides its strain; describe it from a frame that moves along"
            : "rounding hides the contact pressure; lower contact.stiffness or bring the body nearer";
  if (report.outcome != Outcome::right) return report;

  report.stage = contact.stage;
  report.newton_iterations = contact.iterations;
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), f = contact.force.template segment<d>(i * d);
    report.max_penetration = std::max(report.max_penetration, next_.contact_u.segment<d>(i * d).dot(nu) - loads.gap[i]);
    report.normal_force += f.dot(nu);
    report.traction -= f;
    report.friction_traction -= f - f.dot(nu) * nu;
    const Status status = contact.status[static_cast<std::size_t>(i)];
    ++(status == Status::open ? report.open : status == Status::stick ? report.stick : report.slip);
  }
  contact_force_ = std::move(contact.force);
  status_ = std::move(contact.status);
  std::swap(now_, next_);
  time_ += options_.k;
  ++cost_.steps;
  cost_.substitutions += momentum_->substitutions() + (heat_ ? heat_->substitutions() : 0) - solves;
  return report;
}

template <int d>
std::string Stepper<d>::solver() const {
  return momentum_->description() + (heat_ ? "; heat: " + heat_->description() : "");
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
