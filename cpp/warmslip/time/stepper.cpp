#include "warmslip/time/stepper.hpp"

#include <algorithm>
#include <limits>

#include "warmslip/time/timer.hpp"

namespace warmslip {
namespace {

constexpr const char* beyond_doubles = "a number overflowed; scale the data";
constexpr const char* unsupported =
    "nothing was found to hold the body in a step without inertia: it may move and touches nothing, slides freely on "
    "what it touches, or is balanced on its points; give it a support, friction or an [inertia] table";

// A step of which nothing is known: its residuals are not numbers.
template <int d>
StepReport<d> not_taken(Outcome outcome, const std::string& reason) {
  StepReport<d> report;
  report.outcome = outcome;
  report.reason = reason;
  Balances& l = report.balances;
  for (double* unknown :
       {&l.energy_residual, &l.heat_residual, &l.force_residual, &l.law_residual, &l.force_defect, &l.heat_defect})
    *unknown = std::numeric_limits<double>::quiet_NaN();
  return report;
}

}  // namespace

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
  extents_ = {};
  clear_cache();
  if (!rigid_.empty()) {
    WARMSLIP_PETSC(VecCopy(now_.u, now_.strained));
    WARMSLIP_PETSC(VecCopy(now_.w, now_.strained_w));
    rigid_.remove(now_.strained);
    now_.rigid = rigid_.remove(now_.strained_w);
  }
  take_state();
}

template <int d>
void Stepper<d>::part(Vec strained, Vec strained_w, const Eigen::VectorXd& rigid) {
  if (rigid_.empty()) throw std::invalid_argument("supports leave the body no rigid motion");
  if (!strained || !strained_w || rigid.size() != now_.rigid.size())
    throw std::invalid_argument("displacement, velocity and rigid motion are parted together");
  WARMSLIP_PETSC(VecCopy(strained, now_.strained));
  WARMSLIP_PETSC(VecCopy(strained_w, now_.strained_w));
  now_.rigid = rigid;
  take_state();
}

// What follows from the fields that were given.
template <int d>
void Stepper<d>::take_state() {
  if (now_.heating_w) multiply(operators_.heating, now_.straining(), now_.heating_w);
  products(now_);
}

template <int d>
void Stepper<d>::resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status,
                        const FieldExtents& extents) {
  if (contact_force.size() != contact_force_.size() || status.size() != status_.size())
    throw std::invalid_argument("contact forces and statuses need one entry a contact point");
  contact_force_ = now_.contact_force = contact_force;
  status_ = status;
  extents_ = extents;
  clear_cache();
}

template <int d>
void Stepper<d>::clear_cache() {
  if (contact_) contact_->clear_cache();
}

// What the balances read of a step beside its two levels.
template <int d>
StepInputs Stepper<d>::inputs(const StepLoads& loads, const ContactSolution<d>& contact) const {
  return {options_.k,
          loads.force,
          loads.heat,
          monolithic() ? next_.expansion_theta : now_.expansion_theta,
          options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w,
          (monolithic() ? next_ : now_).sizes.theta,
          (options_.coupling == Coupling::lagged ? now_ : next_).sizes.straining,
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

template <int d>
Balances Stepper<d>::balance(const StepInputs& inputs) {
  const Timed timed(cost_.balance_seconds);
  return evaluator_.evaluate(now_, next_, inputs);
}

template <int d>
bool Stepper<d>::closed(const Balances& l) const {
  const double bound = options_.balance_bound;
  return l.heat_residual <= bound && l.force_residual <= bound && l.energy_residual <= bound && l.law_residual <= bound;
}

// Only a step whose balances close becomes the state.
template <int d>
Outcome Stepper<d>::outcome_of(const Balances& l) const {
  if (!std::isfinite(l.kinetic + l.elastic + l.contact + l.viscous + l.load_work + l.conducted + l.heat_change))
    return Outcome::not_finite;
  if (!closed(l)) return Outcome::balance_violated;
  return weighed().largest() <= options_.error_bound ? Outcome::completed : Outcome::precision_lost;
}

// Whether PETSc's options put an iterative solver in the place of a factorization.
template <int d>
bool Stepper<d>::iterative() const {
  return (momentum_ && layout_.sum(momentum_->bytes()) == 0) || (heat_ && layout_.sum(heat_->bytes()) == 0);
}

// The reason for which a step is rejected.
template <int d>
std::string Stepper<d>::why(Outcome outcome, const Balances& l) const {
  const double bound = options_.balance_bound;
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
    case Outcome::balance_violated: {
      for (const auto& [name, residual] : {std::pair{"energy", l.energy_residual}, std::pair{"heat", l.heat_residual},
                                           std::pair{"force", l.force_residual}, std::pair{"law", l.law_residual}})
        if (!(residual <= bound)) list(name);
      return names + (iterative()
                          ? " residual above 1e-10 after iterative refinement: the linear solver tolerance is too loose"
                          : " residual above 1e-10 after iterative refinement: terms of the step cancel beyond double "
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
  undetermined_ = false;
  grazing_ = 1;
  for (Extent* field : extents_.all()) field->tried = 0;
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
    if (finite) report.balances.law_residual = contact.law_residual;
    return report;
  }
  const StepInputs inputs = complete(loads, contact);
  StepReport<d> report = conclude(loads, refine(loads, balance(inputs), contact), contact);
  if (report.outcome == Outcome::completed) cost_.substitutions += substitutions() - before;
  return report;
}

// Accepts or rejects the step; an accepted one becomes the state.
template <int d>
StepReport<d> Stepper<d>::conclude(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact) {
  StepReport<d> report;
  report.balances = balances;
  report.errors = errors_;
  report.undetermined = undetermined_;
  report.outcome = outcome_of(balances);
  report.reason = why(report.outcome, balances);
  if (report.outcome != Outcome::completed) return report;

  for (Extent* field : extents_.all()) field->change = std::max(field->change, field->tried);
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
