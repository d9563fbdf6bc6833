#include "warmslip/stepper.hpp"

#include <algorithm>
#include <limits>

#include "timed.hpp"

namespace warmslip {
namespace {

constexpr const char* beyond_doubles = "a number overflowed; scale the data";

// A step of which nothing is known: its residuals are not numbers.
template <int d>
StepReport<d> not_taken(Outcome outcome, const std::string& reason) {
  StepReport<d> report;
  report.outcome = outcome;
  report.reason = reason;
  Ledger& l = report.ledger;
  for (double* unknown : {&l.energy_residual, &l.heat_residual, &l.force_residual, &l.law_residual, &l.law_floor,
                          &l.energy_floor, &l.force_floor})
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
  if (now_.heating_w) multiply(operators_.heating, now_.w, now_.heating_w);
  products(now_);
}

template <int d>
void Stepper<d>::resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status) {
  if (contact_force.size() != contact_force_.size() || status.size() != status_.size())
    throw std::invalid_argument("contact forces and statuses need one entry a contact point");
  contact_force_ = contact_force;
  status_ = status;
  forget();
}

template <int d>
void Stepper<d>::forget() {
  if (contact_) contact_->forget();
}

// What follows from the velocity (and, monolithic, from the temperature) of the step: u, theta and the products.
template <int d>
StepInputs Stepper<d>::complete(const StepLoads& loads, const ContactSolution<d>& contact) {
  if (next_.w) WARMSLIP_PETSC(VecWAXPY(next_.u, options_.k, next_.w, now_.u));
  next_.gap = loads.gap;
  const Vec heating_w = options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w;
  if (next_.heating_w) multiply(operators_.heating, next_.w, next_.heating_w);  // before the heat that may ask for it
  if (heat_) solve_heat(loads, heating_w);
  products(next_);
  const Vec expansion_theta = monolithic() ? next_.expansion_theta : now_.expansion_theta;
  return {options_.k,      loads.force,   loads.heat, expansion_theta,
          heating_w,       contact.force, free_,      contact_ ? contact_->scale(free_) : 0,
          loads.foundation};
}

// One step of iterative refinement, contact included: the defect is solved for like a load, and the contact problem is
// solved again with the free velocity it corrects. Needed where K is ill-conditioned: large steps on fine meshes.
template <int d>
bool Stepper<d>::refine(const StepLoads& loads, const StepInputs& inputs, ContactSolution<d>& contact) {
  const bool monolithic = this->monolithic();
  books_.momentum_defect(now_, next_, inputs, momentum_right_);
  if (monolithic) {
    books_.heat_defect(now_, next_, inputs, heat_right_);
    join(momentum_right_, heat_right_, coupled_right_);
  }
  const Eigen::VectorXd correction = reduce(monolithic ? coupled_right_ : momentum_right_);
  ContactSolution<d> again;
  again.converged = true;
  const Eigen::VectorXd before = contact.force;
  if (contact_) {
    const Eigen::VectorXd velocity = surface_.at_points(surface_.nodal_values(next_.w));
    free_ = velocity + contact_->compliance() * before + correction;
    if (!solve_contact(loads, free_, before, again)) return false;
  }
  momentum_->expand(contact_ ? surface_.to_nodes(again.force - before) : Eigen::VectorXd(),
                    monolithic ? coupled_ : correction_w_);
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

template <int d>
Ledger Stepper<d>::balance(const StepInputs& inputs) {
  const Timed timed(cost_.books_seconds);
  return books_.close(now_, next_, inputs);
}

// Only a step that closes its books becomes the state.
template <int d>
Outcome Stepper<d>::judge(const Ledger& l) const {
  const double bound = options_.identity_bound;
  if (!std::isfinite(l.kinetic + l.elastic + l.contact + l.viscous + l.load_work + l.conducted + l.heat_change))
    return Outcome::not_finite;
  if (!(std::max(l.law_floor, l.force_floor) <= options_.floor_bound)) return Outcome::precision_lost;
  const bool closed = l.heat_residual <= bound && l.force_residual <= bound &&
                      l.energy_residual <= bound + l.energy_floor && l.law_residual <= bound + l.law_floor;
  return closed ? Outcome::right : Outcome::identity_violated;
}

// What a step that is not right is told of.
template <int d>
std::string Stepper<d>::why(Outcome outcome, const Ledger& l) const {
  const double bound = options_.identity_bound;
  switch (outcome) {
    case Outcome::not_finite:
      return beyond_doubles;
    case Outcome::precision_lost:
      return l.law_floor <= options_.floor_bound
                 ? "the body moves so far that rounding hides its strain; describe it from a frame that moves along"
                 : "rounding hides the contact pressure; lower contact.stiffness or bring the body nearer";
    case Outcome::identity_violated: {
      std::string names;
      for (const auto& [name, open] :
           {std::pair{"energy", !(l.energy_residual <= bound + l.energy_floor)},
            std::pair{"heat", !(l.heat_residual <= bound)}, std::pair{"force", !(l.force_residual <= bound)},
            std::pair{"law", !(l.law_residual <= bound + l.law_floor)}})
        if (open) names += (names.empty() ? "" : " and ") + std::string(name);
      return names + " stays open: the linear solver is loose, or rounding takes the digits";
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

template <int d>
StepReport<d> Stepper<d>::attempt(const StepLoads& loads) {
  if (loads.gap.size() != surface_.points()) throw std::invalid_argument("the gap needs one value a contact point");
  if ((momentum_ && !loads.force) || (now_.theta && !loads.heat))
    throw std::invalid_argument("a load vector is missing");
  if (reactive() && loads.foundation.size() != surface_.points())
    throw std::invalid_argument("the foundation's temperature needs one value a contact point");
  const Timed timed(cost_.step_seconds);
  const auto substitutions = [&] {
    return (momentum_ ? momentum_->substitutions() : 0) + (heat_ ? heat_->substitutions() : 0);
  };
  const int before = substitutions();
  ContactSolution<d> contact;
  if (momentum_) {
    {
      const Timed part(cost_.momentum_seconds);
      momentum_right_side(loads);
      if (monolithic()) {
        heat_right_side(loads, nullptr, coupled_scale_);
        join(momentum_right_, heat_right_, coupled_right_);
      }
      free_ = reduce(monolithic() ? coupled_right_ : momentum_right_);
    }
    const bool finite = layout_.sum(free_.allFinite() ? 0.0 : 1.0) == 0;
    if (contact_ && (!finite || !solve_contact(loads, free_, contact_force_, contact))) {
      StepReport<d> report = finite ? not_taken<d>(Outcome::contact_not_converged,
                                                   "no stage of the contact solver reached the law; take smaller steps")
                                    : not_taken<d>(Outcome::not_finite, beyond_doubles);
      report.stage = contact.stage;
      report.newton_iterations = contact.iterations;
      if (finite) report.ledger.law_residual = contact.law_residual;
      return report;
    }
    const Timed part(cost_.momentum_seconds);
    momentum_->expand(contact_ ? surface_.to_nodes(contact.force) : Eigen::VectorXd(),
                      monolithic() ? coupled_ : next_.w);
    if (monolithic()) split(coupled_, next_.w, next_.theta);
  }
  const StepInputs inputs = complete(loads, contact);
  Ledger ledger = balance(inputs);
  if (momentum_ &&
      std::max({ledger.energy_residual, ledger.force_residual, monolithic() ? ledger.heat_residual : 0.0}) >
          options_.refinement &&
      refine(loads, inputs, contact))
    ledger = balance(complete(loads, contact));
  StepReport<d> report = conclude(loads, ledger, contact);
  if (report.outcome == Outcome::right) cost_.substitutions += substitutions() - before;
  return report;
}

// Judges the step; one that is right becomes the state.
template <int d>
StepReport<d> Stepper<d>::conclude(const StepLoads& loads, const Ledger& ledger, ContactSolution<d>& contact) {
  StepReport<d> report;
  report.ledger = ledger;
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
std::string Stepper<d>::solver() const {
  if (!momentum_) return "heat: " + heat_->description();
  return momentum_->description() + (heat_ ? "; heat: " + heat_->description() : "");
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
