#include "warmslip/time/stepper.hpp"

#include <algorithm>
#include <limits>

#include "warmslip/time/timer.hpp"

namespace warmslip {
namespace {

constexpr const char* unsupported =
    "nothing was found to hold the body in a step without inertia: it may move and touches nothing, slides freely on "
    "what it touches, or is balanced on its points; give it a support, friction or an [inertia] table";

constexpr const char* no_solution = "no stage of the contact solver reached the law; take smaller steps";
constexpr const char* none_may_exist =
    "no stage of the contact solver reached the law; take smaller steps, or, where the loads may exceed what friction "
    "bears, give the body another support or an [inertia] table";

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
Stepper<d>::Stepper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                    const ContactSurface<d>& surface, StepperOptions options)
    : layout_(layout),
      problem_(problem),
      operators_(operators),
      surface_(surface),
      options_(options),
      evaluator_(layout, problem, operators, surface),
      cache_(std::make_shared<SystemCache<d>>(layout, options.factor_bytes)) {
  if (!problem.moves() && !problem.conducts()) throw std::invalid_argument("a problem needs motion or heat");
  set_step(options.k);
  take_vectors();
}

template <int d>
Stepper<d>::Stepper(const Problem<d>& problem, const Stepper& like)
    : layout_(like.layout_),
      problem_(problem),
      operators_(like.operators_),
      surface_(like.surface_),
      options_(like.options_),
      evaluator_(layout_, problem, operators_, surface_, &like.evaluator_),
      cache_(like.cache_) {
  if (problem.contact_heats() != like.problem_.contact_heats())
    throw std::invalid_argument("a stepper can share its factors where contact heats in both problems or in none");
  set_step(options_.k);
  take_vectors();
  clear_cache();
}

template <int d>
void Stepper<d>::set_step(double k) {
  if (systems_ && systems_->k == k) return;
  const CpuTimed timed(cost_.setup_seconds);
  if (auto kept = cache_->find(k)) {
    systems_ = std::move(kept);
  } else {
    try {
      systems_ = std::make_shared<StepSystems<d>>(layout_, problem_, operators_, surface_, k, options_.coupling,
                                                  options_.backend, options_.contact);
    } catch (const SolveFailed& failure) {  // between steps: refused
      throw std::invalid_argument(failure.what());
    }
    cache_->keep(systems_);
    cost_.factorizations += systems_->factorizations();
  }
  evaluator_.take_shares(systems_->rigid, systems_->sprung);
  if (!systems_->constants.empty() && !heat_external_) heat_external_ = layout_.vector(1);
  cost_.factor_bytes = cache_->bytes();
}

template <int d>
double Stepper<d>::refactoring_price() const {
  const double flops = layout_.sum(systems_->flops()), bytes = layout_.sum(systems_->bytes());
  return flops > 0 && bytes > 0 ? flops / bytes : 20;
}

template <int d>
void Stepper<d>::take_vectors() {
  const bool moves = problem_.moves(), conducts = problem_.conducts();
  for (TimeLevel* level : {&now_, &next_}) {
    if (moves) {
      level->u = layout_.vector(d);
      level->w = layout_.vector(d);
    }
    if (conducts) {
      level->theta = layout_.vector(1);
      level->mass_theta = layout_.vector(1);
    }
    if (operators_.inertia) level->momentum = layout_.vector(d);
    if (operators_.elasticity) level->elastic_u = layout_.vector(d);
    if (!systems_->rigid.empty())
      for (VecHandle* v : {&level->strained, &level->strained_w}) *v = layout_.vector(d);
    if (systems_->sprung && operators_.springs) level->sprung = layout_.vector(d);
    level->rigid = Eigen::VectorXd::Zero(systems_->rigid.count());
    if (operators_.expansion && moves) level->expansion_theta = layout_.vector(d);
    if (operators_.heating && moves) level->heating_w = layout_.vector(1);
    level->contact_force = Eigen::VectorXd::Zero(surface_.points() * d);
  }
  if (moves)
    for (VecHandle* v : {&momentum_right_, &correction_w_}) *v = layout_.vector(d);
  if (conducts)
    for (VecHandle* v : {&heat_right_, &correction_theta_}) *v = layout_.vector(1);
  if (!systems_->rigid.empty())
    for (VecHandle* v : {&momentum_external_, &correction_strained_}) *v = layout_.vector(d);
  if (systems_->sprung) beside_shape_ = layout_.vector(d);
  if (!systems_->constants.empty()) heat_external_ = layout_.vector(1);
  if (operators_.common_reference != 0) warmer_ = layout_.vector(1);
  if (moves && conducts && options_.coupling == Coupling::monolithic)
    for (VecHandle* v : {&coupled_right_, &coupled_}) *v = layout_.vector(d + 1);
  if (reactive()) {
    Eigen::VectorXd held = Eigen::VectorXd::Zero(layout_.mesh().nodes.rows());
    for (const PetscInt i : operators_.prescribed_temperature) held[i] = 1;
    held = layout_.sum(std::move(held));
    for (const PetscInt i : surface_.global_nodes()) fixed_contact_.push_back(held[i] > 0);
  }
  contact_force_ = drive_ = Eigen::VectorXd::Zero(surface_.points() * d);
  status_.assign(static_cast<std::size_t>(surface_.points()), Status::open);
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
  contact_force_ = now_.contact_force = Eigen::VectorXd::Zero(surface_.points() * d);
  status_.assign(static_cast<std::size_t>(surface_.points()), Status::open);
  time_ = time;
  taken_ = static_cast<int>(std::lround(std::min(time / systems_->k, 2e9)));
  before_.reset();
  extents_ = {};
  clear_cache();
  if (!systems_->rigid.empty()) {
    WARMSLIP_PETSC(VecCopy(now_.u, now_.strained));
    WARMSLIP_PETSC(VecCopy(now_.w, now_.strained_w));
    systems_->rigid.remove(now_.strained);
    now_.rigid = systems_->rigid.remove(now_.strained_w);
  }
  take_state();
}

template <int d>
void Stepper<d>::part(Vec strained, Vec strained_w, const Eigen::VectorXd& rigid) {
  if (systems_->rigid.empty()) throw std::invalid_argument("supports leave the body no rigid motion");
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
                        const FieldExtents& extents, int taken) {
  if (contact_force.size() != contact_force_.size() || status.size() != status_.size())
    throw std::invalid_argument("contact forces and statuses need one entry a contact point");
  contact_force_ = now_.contact_force = contact_force;
  status_ = status;
  extents_ = extents;
  taken_ = taken;
  clear_cache();
}

template <int d>
void Stepper<d>::clear_cache() {
  cache_->clear_contact_caches();
}

// What the balances read of a step beside its two levels.
template <int d>
StepInputs Stepper<d>::inputs(const StepLoads& loads, const ContactSolution<d>& contact) const {
  return {systems_->k,
          loads.force,
          loads.heat,
          monolithic() ? next_.expansion_theta : now_.expansion_theta,
          options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w,
          (monolithic() ? next_ : now_).sizes.theta,
          (options_.coupling == Coupling::lagged ? now_ : next_).sizes.straining,
          contact.force,
          free_,
          loads.foundation,
          drive_,
          loads.support_velocity,
          1e-5 * extents_.motion.cwiseMax(next_.reach)};
}

// What follows from the velocity (and, monolithic, from the temperature) of the step: u, theta and the products.
template <int d>
StepInputs Stepper<d>::complete(const StepLoads& loads, const ContactSolution<d>& contact) {
  if (next_.w) WARMSLIP_PETSC(VecWAXPY(next_.u, systems_->k, next_.w, now_.u));
  if (next_.strained) WARMSLIP_PETSC(VecWAXPY(next_.strained, systems_->k, next_.strained_w, now_.strained));
  next_.gap = loads.gap;
  if (systems_->contact) next_.contact_force = contact.force;
  if (next_.heating_w)
    multiply(operators_.heating, next_.straining(), next_.heating_w);  // before the heat that may ask for it
  if (systems_->heat) solve_heat(loads, options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w);
  products(next_);
  return inputs(loads, contact);
}

template <int d>
Balances Stepper<d>::balance(const StepInputs& inputs) {
  const WallTimed timed(cost_.balance_seconds);
  return evaluator_.evaluate(now_, next_, inputs);
}

template <int d>
StepReport<d> Stepper<d>::advance(const StepLoads& loads) {
  const FieldExtents extents_before = extents_;
  try {
    return attempt(loads);
  } catch (const SolveFailed& failure) {  // on all ranks alike
    extents_ = extents_before;
    return not_taken<d>(Outcome::solver_failed, failure.what());
  } catch (...) {  // memory ran out: a later try is to find nothing of this one
    extents_ = extents_before;
    clear_cache();
    throw;
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
  if ((systems_->momentum && !loads.force) || (now_.theta && !loads.heat))
    throw std::invalid_argument("a load vector is missing");
  if (reactive() && loads.foundation.size() != surface_.points())
    throw std::invalid_argument("the foundation's temperature needs one value a contact point");
  if (loads.foundation_velocity.size() != 0 && loads.foundation_velocity.size() != surface_.points() * d)
    throw std::invalid_argument("the foundation's velocity needs d values a contact point");
  const CpuTimed timed(cost_.step_seconds);
  const int before = substitutions();
  drive_ = surface_.tangential(loads.foundation_velocity);
  errors_ = {};
  undetermined_ = false;
  grazing_ = 1;
  before_.reset();
  const FieldExtents extents_before = extents_;
  for (Extent* field : extents_.all()) field->tried = 0;
  ContactSolution<d> contact;
  const bool solved = !systems_->momentum || solve_motion(loads, contact), vanish = squares_vanish(loads, contact);
  if (!solved || vanish) {
    const bool finite = in_range(free_) && !vanish;
    StepReport<d> report = vanish                ? not_taken<d>(Outcome::not_finite, squares_gone)
                           : !finite             ? not_taken<d>(Outcome::not_finite, beyond_doubles)
                           : contact.unsupported ? not_taken<d>(Outcome::unsupported, unsupported)
                           : systems_->rigid.empty() || problem_.inertial()
                               ? not_taken<d>(Outcome::contact_not_converged, no_solution)
                               : not_taken<d>(Outcome::contact_not_converged, none_may_exist);
    report.stage = contact.stage;
    report.newton_iterations = contact.iterations;
    if (finite) report.balances.law_residual = contact.law_residual;
    return report;
  }
  StepReport<d> report = conclude(loads, refine(loads, balances_of(loads, contact), contact), contact);
  if (report.outcome != Outcome::completed) {
    extents_ = extents_before;  // what was not taken counts in no later step
    return report;
  }
  before_->extents = extents_before;
  cost_.substitutions += substitutions() - before;
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
  note_sizes(contact);
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
  before_ = Before{contact_force_, status_, {}, time_};
  if (systems_->contact) {
    contact_force_ = std::move(contact.force);
    status_ = std::move(contact.status);
  }
  std::swap(now_, next_);
  time_ = std::isfinite(loads.time) ? loads.time : time_ + systems_->k;
  ++taken_;
  ++cost_.steps;
  settle_rest();
  return report;
}

// Sets a motion that has ended, and a temperature, to zero: what is left is rounding of rounding, which would shrink in
// every step until squares of it are no numbers.
template <int d>
void Stepper<d>::settle_rest() {
  constexpr double nothing = 1e-30;  // of the largest value so far
  const auto zero = [](Vec v) {
    if (v) WARMSLIP_PETSC(VecSet(v, 0));
  };
  const double least = nothing * extents_.u.size;
  const bool cold = now_.sizes.theta > 0 && now_.sizes.theta < nothing * extents_.theta.size;
  const bool small = now_.u && now_.sizes.u < least && systems_->k * now_.sizes.w < least;
  const bool rests = small && now_.sizes.u + now_.sizes.w > 0 && largest_entry(now_.u) < least;
  if (rests) {
    for (Vec v : {Vec(now_.u), Vec(now_.w), Vec(now_.strained), Vec(now_.strained_w)}) zero(v);
    now_.rigid.setZero();
    if (contact_force_.size() > 0 &&
        contact_force_.template lpNorm<Eigen::Infinity>() <= nothing * extents_.contact_force.size)
      contact_force_ = now_.contact_force = Eigen::VectorXd::Zero(contact_force_.size());
  }
  if (cold) zero(now_.theta);
  if (rests || cold) take_state();
}

template <int d>
void Stepper<d>::revert() {
  if (!before_) throw std::invalid_argument("there is no step that could be taken back");
  std::swap(now_, next_);
  contact_force_ = std::move(before_->contact_force);
  status_ = std::move(before_->status);
  extents_ = before_->extents;
  time_ = before_->time;
  before_.reset();
  --taken_;
  --cost_.steps;
  clear_cache();
}

template <int d>
int Stepper<d>::substitutions() const {
  return systems_->substitutions();
}

template <int d>
std::string Stepper<d>::solver() const {
  if (!systems_->momentum) return "heat: " + systems_->heat->description();
  return systems_->momentum->description() + (systems_->heat ? "; heat: " + systems_->heat->description() : "");
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
