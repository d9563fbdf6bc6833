#include "warmslip/stepper.hpp"

#include <algorithm>
#include <limits>

#include "timed.hpp"

namespace warmslip {
namespace {

constexpr const char* beyond_doubles = "a number overflowed; scale the data";
constexpr const char* unsupported =
    "nothing holds the body in a step without inertia: it may move and touches nothing, or slides freely on what it "
    "touches; give it a support, friction or an [inertia] table";

// A step of which nothing is known: its residuals are not numbers.
template <int d>
StepReport<d> not_taken(Outcome outcome, const std::string& reason) {
  StepReport<d> report;
  report.outcome = outcome;
  report.reason = reason;
  Ledger& l = report.ledger;
  for (double* unknown :
       {&l.energy_residual, &l.heat_residual, &l.force_residual, &l.law_residual, &l.force_defect, &l.heat_defect})
    *unknown = std::numeric_limits<double>::quiet_NaN();
  return report;
}

double largest_entry(Vec v) {
  PetscReal value = 0;
  if (v) WARMSLIP_PETSC(VecNorm(v, NORM_INFINITY, &value));
  return value;
}

double largest_entry(const Eigen::VectorXd& v) { return v.size() ? v.cwiseAbs().maxCoeff() : 0; }

}  // namespace

double Errors::largest() const {
  double worst = 0;
  for (const double error : {u, theta, stress, contact_force})
    if (std::isgreater(error, worst)) worst = error;  // quiet about nan, also where it traps
  return worst;
}

template <int d>
void Stepper<d>::start(Vec u, Vec w, Vec theta, const Eigen::VectorXd& gap, double time) {
  if (gap.size() != surface_.points()) throw std::invalid_argument("the gap needs one value a contact point");
  const auto take = [](Vec from, const VecHandle& to, const char* name) {
    if ((from != nullptr) != (to != nullptr))
      throw std::invalid_argument(std::string(name) + (to ? " is missing" : " is no field of this problem"));
    if (to) WARMSLIP_PETSC(VecCopy(from, to));
  };
  take(u, now_.u, "u");
  take(w, now_.w, "w");
  take(theta, now_.theta, "theta");
  now_.gap = gap;
  time_ = time;
  forget();
  if (now_.heating_w) multiply(operators_.heating, now_.straining(), now_.heating_w);
  products(now_);
}

template <int d>
void Stepper<d>::resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status) {
  if (contact_force.size() != contact_force_.size() || status.size() != status_.size())
    throw std::invalid_argument("contact forces and statuses need one entry a contact point");
  contact_force_ = now_.contact_force = contact_force;
  status_ = status;
  forget();
}

// A run that goes on knows u alone.
template <int d>
void Stepper<d>::forget() {
  if (contact_) contact_->forget();
  if (rigid_.empty()) return;
  WARMSLIP_PETSC(VecCopy(now_.u, now_.strained));
  WARMSLIP_PETSC(VecCopy(now_.w, now_.strained_w));
  rigid_.remove(now_.strained);
  now_.rigid = rigid_.remove(now_.strained_w);
  products(now_);
}

// What the balances read of a step beside its two levels.
template <int d>
StepInputs Stepper<d>::inputs(const StepLoads& loads, const ContactSolution<d>& contact) const {
  return {options_.k,
          loads.force,
          loads.heat,
          monolithic() ? next_.expansion_theta : now_.expansion_theta,
          options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w,
          monolithic() ? next_.theta : now_.theta,
          options_.coupling == Coupling::lagged ? now_.straining() : next_.straining(),
          contact.force,
          free_,
          loads.foundation};
}

// What follows from the velocity (and, monolithic, from the temperature) of the step: u, theta and the products.
template <int d>
StepInputs Stepper<d>::complete(const StepLoads& loads, const ContactSolution<d>& contact) {
  if (next_.w) WARMSLIP_PETSC(VecWAXPY(next_.u, options_.k, next_.w, now_.u));
  if (next_.strained) WARMSLIP_PETSC(VecWAXPY(next_.strained, options_.k, next_.strained_w, now_.strained));
  next_.gap = loads.gap;
  if (contact_) next_.contact_force = contact.force;
  if (next_.heating_w)
    multiply(operators_.heating, next_.straining(), next_.heating_w);  // before the heat that may ask for it
  if (heat_) solve_heat(loads, options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w);
  products(next_);
  return inputs(loads, contact);
}

// Notes a change as a field's error relative to its largest value so far.
template <int d>
void Stepper<d>::note(double& error, double& scale, double change, double size) {
  scale = std::max(scale, size);
  error = scale > 0 ? change / scale : 0;
}

// One step of iterative refinement, contact included: the defect is solved for like a load, and the contact problem is
// solved again with the free velocity it corrects. What changes is an estimate of the errors; with `apply` it is taken.
template <int d>
bool Stepper<d>::correct_motion(const StepLoads& loads, const Ledger& ledger, ContactSolution<d>& contact, bool apply) {
  const bool monolithic = this->monolithic();
  const StepInputs inputs = this->inputs(loads, contact);
  books_.momentum_defect(now_, next_, inputs, momentum_right_, momentum_external_);
  if (!apply) books_.add_rounding(momentum_right_, momentum_external_);
  if (monolithic) {
    books_.heat_defect(now_, next_, inputs, heat_right_);
    if (!apply) books_.add_rounding(heat_right_, nullptr);
    join(momentum_right_, heat_right_, coupled_right_);
  }
  const Eigen::VectorXd correction = reduce(monolithic ? coupled_right_ : momentum_right_, momentum_external_);
  ContactSolution<d> change, again;
  if (contact_) {
    const Eigen::VectorXd velocity = surface_.at_points(surface_.nodal_values(next_.w));
    posed_.known_force = contact.force;
    posed_.known_velocity = apply ? velocity + correction : velocity;
    posed_.rigid = rigid_load_;
    posed_.free = posed_.known_velocity + contact_->compliance() * contact.force;
    again = contact;
    if (!(apply ? solve_contact(contact.force, again) : contact_->respond(posed_, correction, again))) return false;
    if (apply) free_ = posed_.free;
    change = again;
    change.force = again.added;
    if (apply) again.iterations += contact.iterations;
    again.stage = std::max(again.stage, contact.stage);
  }
  const Eigen::VectorXd motions = expand(change, monolithic ? coupled_ : correction_w_, correction_strained_);
  if (monolithic) {
    split(coupled_, correction_w_, correction_theta_);
    note(errors_.theta, scales_.theta, largest_entry(correction_theta_),
         std::max(largest_entry(next_.theta), ledger.temperature_scale));
    if (apply) WARMSLIP_PETSC(VecAXPY(next_.theta, 1, correction_theta_));
  }
  if (contact_) {
    const Vec moved = momentum_right_;
    WARMSLIP_PETSC(VecWAXPY(moved, 1, correction_w_, next_.w));
    settle(again, moved, correction_strained_);
    WARMSLIP_PETSC(VecWAXPY(correction_w_, -1, next_.w, moved));
  }
  note(errors_.u, scales_.u, options_.k * largest_entry(correction_w_),
       std::max({largest_entry(next_.u), largest_entry(now_.u), ledger.displacement_scale}));
  if (next_.elastic_u || operators_.viscosity) {
    const Vec change_w = correction_strained_ ? correction_strained_ : correction_w_, change_u = momentum_right_;
    WARMSLIP_PETSC(VecCopy(change_w, change_u));
    WARMSLIP_PETSC(VecScale(change_u, options_.k));
    const StressSize there = stress_size(layout_, problem_, next_.shape(), next_.straining());
    double by_forces = Errors::unknown;
    note(errors_.stress, scales_.stress, stress_size(layout_, problem_, change_u, change_w).largest,
         std::max(there.largest, 1e-8 * there.possible));
    if (next_.elastic_u) {  // inner forces far smaller than the others matter to nobody
      multiply(operators_.elasticity, change_w, momentum_right_);
      note(by_forces, scales_.force, options_.k * largest_entry(momentum_right_), ledger.force_scale);
      errors_.stress = std::min(errors_.stress, by_forces);
    }
  }
  if (contact_) {
    note(errors_.contact_force, scales_.contact_force, largest_entry(surface_.to_nodes(change.force)),
         std::max(largest_entry(surface_.to_nodes(contact.force)), 1e-9 * ledger.force_scale));
    scales_.force = std::max(scales_.force, ledger.force_scale);
    if (scales_.force > 0) grazing_ = std::min(1.0, 1e2 * scales_.contact_force / scales_.force);
  }
  if (apply) {
    if (contact_) contact = std::move(again);
    WARMSLIP_PETSC(VecAXPY(next_.w, 1, correction_w_));
    if (!rigid_.empty()) {
      WARMSLIP_PETSC(VecAXPY(next_.strained_w, 1, correction_strained_));
      next_.rigid += motions;
    }
  }
  return true;
}

// Takes the force of points that are held by their law from the equations of their nodes, where compliances leave it
// only as many digits as the largest force has.
template <int d>
void Stepper<d>::react(const StepInputs& inputs, ContactSolution<d>& contact) {
  books_.momentum_defect(now_, next_, inputs, momentum_right_);
  const Eigen::VectorXd left = surface_.nodal_values(momentum_right_), velocities = surface_.nodal_values(next_.w);
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Eigen::Index node = surface_.own_node(i);
    const Status status = contact.status[static_cast<std::size_t>(i)];
    if (node < 0 || status == Status::open) continue;
    const Point<d> nu = surface_.normals().row(i).transpose(), rest = left.segment<d>(node * d),
                   velocity = velocities.segment<d>(node * d), slip = velocity - velocity.dot(nu) * nu;
    const bool rests = status == Status::stick && slip.norm() <= 1e-15 * velocity.norm();
    contact.force.template segment<d>(i * d) += rests ? rest : Point<d>(rest.dot(nu) * nu);
  }
}

template <int d>
void Stepper<d>::correct_heat(const StepInputs& inputs, const Ledger& ledger, bool apply) {
  books_.heat_defect(now_, next_, inputs, heat_right_, heat_external_);
  if (!apply) books_.add_rounding(heat_right_, heat_external_);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(given_flow_.size());
  solve_heat(heat_right_, heat_external_, none, none, correction_theta_);
  note(errors_.theta, scales_.theta, largest_entry(correction_theta_),
       std::max(largest_entry(next_.theta), ledger.temperature_scale));
  if (apply) WARMSLIP_PETSC(VecAXPY(next_.theta, 1, correction_theta_));
}

// Refines motion, then heat, as long as it helps; in some steps the digits are estimated although all is well.
template <int d>
Ledger Stepper<d>::refine(const StepLoads& loads, Ledger ledger, ContactSolution<d>& contact) {
  const double enough = options_.refinement, rows = enough / options_.row_refinement;
  const auto warmth = [&] { return std::max(ledger.heat_defect, rows * ledger.heat_residual); };
  const auto motion = [&] {
    return std::max(
        {ledger.force_defect, rows * ledger.force_residual, ledger.law_residual, monolithic() ? warmth() : 0.0});
  };
  // a pass whose change is small says that the one before has done its work
  const auto done = [&](double rest, double error) { return rest <= enough && !std::isgreater(error, 1e-9); };
  bool refined = false, warmed = false;
  double warmer = Errors::unknown;
  for (int pass = 0; momentum_ && pass < options_.passes && !done(motion(), errors_.largest()); ++pass) {
    const double rest = motion(), error = errors_.largest();
    if (contact_ && ledger.force_defect <= enough && ledger.force_residual > enough) {
      react(inputs(loads, contact), contact);
      ledger = balance(complete(loads, contact));
    }
    if (!correct_motion(loads, ledger, contact, true)) break;
    ledger = balance(complete(loads, contact));
    ++cost_.refinements;
    refined = true;
    if (!(motion() < 0.5 * rest) && !(errors_.largest() < 0.5 * error)) break;
  }
  for (int pass = 0; heat_ && pass < options_.passes && !done(warmth(), errors_.theta); ++pass) {
    const double rest = warmth();
    correct_heat(inputs(loads, contact), ledger, true);
    products(next_);
    ledger = balance(inputs(loads, contact));
    ++cost_.refinements;
    if (!(warmth() < 0.5 * rest) && warmed && !(errors_.theta < 0.5 * warmer)) break;
    warmer = errors_.theta;
    warmed = true;
  }
  const bool wanted = measured_now(loads, contact);
  if (!wanted && !refined && !warmed) return ledger;
  const int before = substitutions();
  if (momentum_ && (refined || wanted)) correct_motion(loads, ledger, contact, false);
  if (heat_ && (warmed || wanted)) correct_heat(inputs(loads, contact), ledger, false);
  cost_.substitutions -= substitutions() - before;
  ++cost_.estimates;
  return ledger;
}

// Whether the step that is being taken is one whose digits are measured anyway; counted from time zero, so that a run
// that goes on measures the same ones.
template <int d>
bool Stepper<d>::measured_now(const StepLoads& loads, const ContactSolution<d>& contact) const {
  if (loads.measured || (now_.contact_force.isZero(0) && !contact.force.isZero(0))) return true;
  for (double step = 1, n = std::round(time_ / options_.k) + 1; step <= n; step *= options_.measured_steps)
    if (step == n) return true;
  return false;
}

template <int d>
Ledger Stepper<d>::balance(const StepInputs& inputs) {
  const Timed timed(cost_.books_seconds);
  return books_.close(now_, next_, inputs);
}

// The errors that may end a run: that of a contact that hardly touches is seen beside the other forces.
template <int d>
Errors Stepper<d>::weighed() const {
  Errors out = errors_;
  out.contact_force *= grazing_;
  return out;
}

// Only a step that closes its books becomes the state.
template <int d>
Outcome Stepper<d>::judge(const Ledger& l) const {
  if (!std::isfinite(l.kinetic + l.elastic + l.contact + l.viscous + l.load_work + l.conducted + l.heat_change))
    return Outcome::not_finite;
  const double bound = options_.identity_bound;
  const bool closed =
      l.heat_residual <= bound && l.force_residual <= bound && l.energy_residual <= bound && l.law_residual <= bound;
  if (!closed) return Outcome::identity_violated;
  return weighed().largest() <= options_.error_bound ? Outcome::right : Outcome::precision_lost;
}

// Whether PETSc's options put an iterative solver in the place of a factorization.
template <int d>
bool Stepper<d>::iterative() const {
  return (momentum_ && layout_.sum(momentum_->bytes()) == 0) || (heat_ && layout_.sum(heat_->bytes()) == 0);
}

// What a step that is not right is told of.
template <int d>
std::string Stepper<d>::why(Outcome outcome, const Ledger& l) const {
  const double bound = options_.identity_bound;
  std::string names;
  const auto list = [&](const char* name) { names += (names.empty() ? "" : " and ") + std::string(name); };
  switch (outcome) {
    case Outcome::not_finite:
      return beyond_doubles;
    case Outcome::precision_lost:
      for (const auto& [name, error] :
           {std::pair{"u", errors_.u}, std::pair{"theta", errors_.theta}, std::pair{"the stress", errors_.stress},
            std::pair{"the contact force", weighed().contact_force}})
        if (std::isgreater(error, options_.error_bound)) list(name);
      return "fewer than four digits of " + names +
             " can be trusted: the equations are solved to round-off, but their operator is too ill-conditioned for "
             "double "
             "precision; shorten the steps, or bring stiffnesses and lengths nearer to each other";
    case Outcome::identity_violated: {
      for (const auto& [name, residual] : {std::pair{"energy", l.energy_residual}, std::pair{"heat", l.heat_residual},
                                           std::pair{"force", l.force_residual}, std::pair{"law", l.law_residual}})
        if (!(residual <= bound)) list(name);
      return names + (iterative()
                          ? " stays open: the linear solver is loose, and refinement does not mend it"
                          : " stays open, and refinement does not mend it: terms of the step cancel beyond double "
                            "precision; shorten the steps, or bring stiffnesses and lengths nearer to each other");
    }
    default:
      return "";
  }
}

template <int d>
StepReport<d> Stepper<d>::advance(const StepLoads& loads) {
  try {
    return attempt(loads);
  } catch (const SolveFailed& failure) {  // on all ranks alike
    return not_taken<d>(Outcome::solver_failed, failure.what());
  }
}

// Whether the squares of numbers are numbers, on all ranks.
template <int d>
bool Stepper<d>::in_range(const Eigen::VectorXd& values) const {
  return layout_.sum(std::isfinite(values.squaredNorm()) ? 0.0 : 1.0) == 0;
}

template <int d>
StepReport<d> Stepper<d>::attempt(const StepLoads& loads) {
  if (loads.gap.size() != surface_.points()) throw std::invalid_argument("the gap needs one value a contact point");
  if ((momentum_ && !loads.force) || (now_.theta && !loads.heat))
    throw std::invalid_argument("a load vector is missing");
  if (reactive() && loads.foundation.size() != surface_.points())
    throw std::invalid_argument("the foundation's temperature needs one value a contact point");
  const Timed timed(cost_.step_seconds);
  const int before = substitutions();
  errors_ = {};
  grazing_ = 1;
  ContactSolution<d> contact;
  if (momentum_ && !solve_motion(loads, contact)) {
    const bool finite = in_range(free_);
    StepReport<d> report = !finite ? not_taken<d>(Outcome::not_finite, beyond_doubles)
                           : contact.unsupported
                               ? not_taken<d>(Outcome::unsupported, unsupported)
                               : not_taken<d>(Outcome::contact_not_converged,
                                              "no stage of the contact solver reached the law; take smaller steps");
    report.stage = contact.stage;
    report.newton_iterations = contact.iterations;
    if (finite) report.ledger.law_residual = contact.law_residual;
    return report;
  }
  const StepInputs inputs = complete(loads, contact);
  StepReport<d> report = conclude(loads, refine(loads, balance(inputs), contact), contact);
  if (report.outcome == Outcome::right) cost_.substitutions += substitutions() - before;
  return report;
}

// Judges the step; one that is right becomes the state.
template <int d>
StepReport<d> Stepper<d>::conclude(const StepLoads& loads, const Ledger& ledger, ContactSolution<d>& contact) {
  StepReport<d> report;
  report.ledger = ledger;
  report.errors = errors_;
  report.outcome = judge(ledger);
  report.reason = why(report.outcome, ledger);
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
  if (contact_) {
    contact_force_ = std::move(contact.force);
    status_ = std::move(contact.status);
  }
  std::swap(now_, next_);
  time_ += options_.k;
  ++cost_.steps;
  return report;
}

template <int d>
int Stepper<d>::substitutions() const {
  return (momentum_ ? momentum_->substitutions() : 0) + (heat_ ? heat_->substitutions() : 0);
}

template <int d>
std::string Stepper<d>::solver() const {
  if (!momentum_) return "heat: " + heat_->description();
  return momentum_->description() + (heat_ ? "; heat: " + heat_->description() : "");
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
