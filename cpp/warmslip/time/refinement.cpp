// Iterative refinement of a step, contact included. With a sample of rounding in its defect it estimates errors, which
// digits.cpp turns into digits.
#include <algorithm>
#include <cmath>
#include <limits>

#include "warmslip/time/stepper.hpp"

namespace warmslip {
// One step of iterative refinement, contact included: the defect is solved for like a load, and the contact problem is
// solved again with the free velocity it corrects. With a sample of rounding in the defect, what changes is an estimate
// of the errors; without one the change is taken.
template <int d>
bool Stepper<d>::correct_motion(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact,
                                std::optional<int> sample) {
  const bool monolithic = this->monolithic(), apply = !sample;
  const StepInputs inputs = this->inputs(loads, contact);
  evaluator_.momentum_defect(now_, next_, inputs, momentum_right_, momentum_external_);
  if (sample) evaluator_.add_rounding(*sample, momentum_right_, momentum_external_);
  if (monolithic) {
    coupled_heat_defect(inputs, sample);
    join(momentum_right_, heat_right_, coupled_right_);
  }
  const Eigen::VectorXd correction = reduce(monolithic ? coupled_right_ : momentum_right_, momentum_external_);
  ContactSolution<d> change, again;
  correction_force_ = Eigen::VectorXd::Zero(next_.contact_force.size());
  Eigen::VectorXd cause;
  double crept = 0;  // what the contact leaves of motions that it stops, whether its response takes it away or not
  if (systems_->contact) {
    const Eigen::VectorXd velocity = sliding(next_.w);
    posed_.known_force = contact.force;
    posed_.known_velocity = apply ? velocity + correction : velocity;
    posed_.rigid = rigid_load_;
    posed_.free = posed_.known_velocity + systems_->contact->compliance() * contact.force;
    again = contact;
    const Eigen::VectorXd left = apply ? Eigen::VectorXd() : creep(contact);
    crept = largest_entry(left);
    if (!apply) cause = correction + left + rounding(velocity);
    if (!(apply ? solve_contact(contact.force, again) : respond(cause, {}, again))) return false;
    if (apply) free_ = posed_.free;
    change = again;
    change.force = again.added;
    if (apply) again.iterations += contact.iterations;
    again.stage = std::max(again.stage, contact.stage);
  }
  const Eigen::VectorXd motions =
      expand(change, systems_->rigid.empty() ? correction_w_ : correction_strained_, correction_theta_);
  if (!systems_->rigid.empty()) {
    WARMSLIP_PETSC(VecCopy(correction_strained_, correction_w_));
    systems_->rigid.carry(motions, correction_w_);
  }
  if (monolithic) {
    note_temperature(balances);
    if (apply) WARMSLIP_PETSC(VecAXPY(next_.theta, 1, correction_theta_));
  }
  if (systems_->contact) {
    const Vec moved = momentum_right_;
    WARMSLIP_PETSC(VecWAXPY(moved, 1, correction_w_, next_.w));
    apply_contact_velocity(again, moved, correction_strained_);
    WARMSLIP_PETSC(VecWAXPY(correction_w_, -1, next_.w, moved));
  }
  note(errors_.u, extents_.u, systems_->k * std::max(largest_entry(correction_w_), crept),
       std::max(largest_entry(next_.u), largest_entry(now_.u)), balances.displacement_scale);
  if (sample) add_drift(motions, now_.contact_force.isZero(0) && !contact.force.isZero(0));
  if (next_.elastic_u || operators_.viscosity) {
    const Vec change_w = correction_strained_ ? correction_strained_ : correction_w_, change_u = momentum_right_;
    WARMSLIP_PETSC(VecCopy(change_w, change_u));
    WARMSLIP_PETSC(VecScale(change_u, systems_->k));
    const bool known = sample && *sample > 0;
    const StressSize there =
        known ? StressSize{} : stress_size(layout_, problem_, next_.shape(), next_.straining(), next_.theta);
    note(errors_.stress, extents_.stress, stress_size(layout_, problem_, change_u, change_w).largest, there.largest,
         1e-8 * there.possible);
    extents_.force = std::max(extents_.force, balances.force_scale);
    if (extents_.force > 0) {  // inner forces far smaller than the others matter to nobody
      double inner = 0;
      for (const auto& [a, factor] :
           {std::pair{Mat(operators_.elasticity), systems_->k}, std::pair{Mat(operators_.viscosity), 1.0}}) {
        if (!a) continue;
        multiply(a, change_w, momentum_right_);
        inner += factor * largest_entry(momentum_right_);
      }
      errors_.stress = std::min(errors_.stress, inner / extents_.force);
    }
  }
  if (systems_->contact) {
    note(errors_.contact_force, extents_.contact_force, largest_entry(surface_.to_nodes(change.force)),
         largest_entry(surface_.to_nodes(contact.force)), balances.contact_scale);
    if (!apply)
      extents_.contact_force.tried = std::max(
          {extents_.contact_force.tried, change_at_rest(cause, contact), change_of_pressure(change.force, contact)});
    correction_force_ = change.force;
    extents_.force = std::max(extents_.force, balances.force_scale);
    if (extents_.force > 0) grazing_ = std::min(1.0, 1e2 * extents_.contact_force.scale / extents_.force);
  }
  if (apply) {
    if (systems_->contact) contact = std::move(again);
    WARMSLIP_PETSC(VecAXPY(next_.w, 1, correction_w_));
    if (!systems_->rigid.empty()) {
      WARMSLIP_PETSC(VecAXPY(next_.strained_w, 1, correction_strained_));
      next_.rigid += motions;
    }
    guide(loads.support_velocity);
  }
  return true;
}

// The defect of the heat equation of a monolithic step, in heat_right_. Conduction warms no part as a whole: what its
// rounding would is taken off, as the capacity of a long step may be far smaller.
template <int d>
void Stepper<d>::coupled_heat_defect(const StepInputs& inputs, std::optional<int> sample) {
  evaluator_.heat_defect(now_, next_, inputs, heat_right_, heat_external_);
  if (sample) evaluator_.add_rounding(*sample, heat_right_, heat_external_);
  if (systems_->constants.empty()) return;
  WARMSLIP_PETSC(VecAXPY(heat_right_, -1, heat_external_));
  systems_->constants.remove(heat_right_);
  WARMSLIP_PETSC(VecAXPY(heat_right_, 1, heat_external_));
}

// The balances of a solved step. The temperature of every part of a monolithic one that conducts far more than it
// stores is first shifted by a constant, so that the part has all of its heat.
template <int d>
Balances Stepper<d>::balances_of(const StepLoads& loads, const ContactSolution<d>& contact) {
  const StepInputs inputs = complete(loads, contact);
  const Balances balances = balance(inputs);
  if (!monolithic() || systems_->constants.empty()) return balances;
  evaluator_.heat_defect(now_, next_, inputs, heat_right_, heat_external_);
  const Eigen::VectorXd missing = systems_->constants.alone(systems_->constants.of(heat_external_));
  if (!(missing.cwiseAbs().maxCoeff() > 1e-15 * next_.sizes.theta)) return balances;
  systems_->constants.carry(missing, next_.theta);
  products(next_);
  return balance(this->inputs(loads, contact));
}

template <int d>
void Stepper<d>::correct_heat(const StepInputs& inputs, const Balances& balances, std::optional<int> sample) {
  evaluator_.heat_defect(now_, next_, inputs, heat_right_, heat_external_);
  if (sample) evaluator_.add_rounding(*sample, heat_right_, heat_external_);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(flow_.given.size());
  solve_heat(heat_right_, heat_external_, none, none, correction_theta_);
  note_temperature(balances);
  const bool keeps = !systems_->constants.empty() && !operators_.exchange && flow_.lost.isZero(0);
  if (sample && keeps) {  // it drifts with the heat it gets
    const Eigen::VectorXd drift = (taken_ + 1.0) * systems_->constants.alone(systems_->constants.of(heat_external_));
    extents_.theta.tried += largest_entry(drift);
    systems_->constants.carry(drift, correction_theta_);
  }
  if (!sample) WARMSLIP_PETSC(VecAXPY(next_.theta, 1, correction_theta_));
}

// The response of the contact; every rank found it, and they agree whether there is one.
template <int d>
bool Stepper<d>::respond(const Eigen::VectorXd& correction, const std::vector<bool>& resting,
                         ContactSolution<d>& contact) {
  int found = systems_->contact->respond(posed_, correction, resting, contact);
  MPI_Bcast(&found, 1, MPI_INT, 0, layout_.comm());
  return found != 0;
}

// The slip of points that stick and the motion of points that press beyond the depth of their force, (d points). The
// solver leaves some where nodes are not points themselves: it is little beside the motion that the contact stops, and
// may be much beside the straining that is left.
template <int d>
Eigen::VectorXd Stepper<d>::creep(const ContactSolution<d>& contact) const {
  bool apart = false;
  for (Eigen::Index i = 0; i < surface_.points(); ++i)
    apart = apart || (surface_.own_node(i) < 0 && !surface_.prescribed(i));
  if (!apart) return Eigen::VectorXd::Zero(surface_.points() * d);
  Eigen::VectorXd out = sliding(next_.w);
  const double tolerated = options_.contact.tolerance * std::max(largest_entry(out), largest_entry(free_));
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const auto point = static_cast<std::size_t>(i);
    const ContactLaw& law = posed_.law(point);
    const Point<d> nu = surface_.normals().row(i).transpose();
    auto motion = out.template segment<d>(i * d);
    const double across = motion.dot(nu), depth = posed_.points[point].penetration + systems_->k * across,
                 pressure = contact.force.template segment<d>(i * d).dot(nu) / surface_.weights()[i];
    Point<d> slip = motion - across * nu;
    const bool sticks =
        contact.status[point] == Status::stick && !surface_.prescribed(i) && law.friction.regularisation == 0;
    if (!sticks || slip.norm() > tolerated) slip.setZero();  // without a bound it sticks and slips as it likes
    double beyond = pressure > 0 && !surface_.prescribed(i)
                        ? (depth - law.compliance.penetration(pressure, depth)) / systems_->k
                        : 0;
    if (!(std::abs(beyond) <= tolerated)) beyond = 0;
    motion = slip + beyond * nu;
  }
  return out;
}

// The velocity (and, monolithic, the temperature) of the step with its contact, to go back to.
template <int d>
typename Stepper<d>::Motion Stepper<d>::motion_of(const ContactSolution<d>& contact) const {
  const auto copy = [](Vec from) {
    VecHandle to;
    if (!from) return to;
    to = duplicate(from);
    WARMSLIP_PETSC(VecCopy(from, to));
    return to;
  };
  return {copy(next_.w), copy(next_.strained_w), monolithic() ? copy(next_.theta) : VecHandle(), next_.rigid, free_,
          contact};
}

template <int d>
void Stepper<d>::undo(const Motion& motion, ContactSolution<d>& contact) {
  WARMSLIP_PETSC(VecCopy(motion.w, next_.w));
  if (motion.strained_w) WARMSLIP_PETSC(VecCopy(motion.strained_w, next_.strained_w));
  if (motion.theta) WARMSLIP_PETSC(VecCopy(motion.theta, next_.theta));
  next_.rigid = motion.rigid;
  free_ = motion.free;
  contact = motion.contact;
}

// Refines motion, then heat, as long as it helps; in some steps the digits are estimated although all is well.
template <int d>
Balances Stepper<d>::refine(const StepLoads& loads, Balances balances, ContactSolution<d>& contact) {
  const double enough = options_.refinement, rows = enough / options_.row_refinement;
  const auto warmth = [&] { return std::max(balances.heat_defect, rows * balances.heat_residual); };
  const auto motion = [&] {
    return std::max(
        {balances.force_defect, rows * balances.force_residual, balances.law_residual, monolithic() ? warmth() : 0.0});
  };
  // a pass whose change is small says that the one before has done its work
  const auto done = [&](double rest, double error) { return rest <= enough && !std::isgreater(error, 1e-9); };
  bool refined = false, warmed = false;
  double warmer = Errors::unknown;
  const bool creeps = systems_->contact && largest_entry(creep(contact)) > 1e-14 * next_.sizes.straining;
  if (creeps && correct_motion(loads, balances, contact)) {
    balances = balances_of(loads, contact);
    ++cost_.refinements;
  }
  forget_errors();
  for (int pass = 0; systems_->momentum && pass < options_.passes && !done(motion(), errors_.largest()); ++pass) {
    const double rest = motion(), error = errors_.largest();
    const Motion before = motion_of(contact);
    const bool was_closed = closed(balances);
    forget_errors();
    if (!correct_motion(loads, balances, contact)) break;
    balances = balances_of(loads, contact);
    ++cost_.refinements;
    refined = true;
    if (was_closed && !closed(balances)) {  // it did harm
      undo(before, contact);
      balances = balances_of(loads, contact);
      break;
    }
    if (!(motion() < 0.5 * rest) && !(errors_.largest() < 0.5 * error)) break;
  }
  for (int pass = 0; systems_->heat && pass < options_.passes && !done(warmth(), errors_.theta); ++pass) {
    const double rest = warmth();
    forget_errors();
    correct_heat(inputs(loads, contact), balances);
    products(next_);
    balances = balance(inputs(loads, contact));
    ++cost_.refinements;
    if (!(warmth() < 0.5 * rest) && warmed && !(errors_.theta < 0.5 * warmer)) break;
    warmer = errors_.theta;
    warmed = true;
  }
  undetermined_ = contact.undetermined;
  const bool wanted = measured_now(loads, contact);
  if (!wanted && !refined && !warmed) return balances;
  const int before = substitutions();
  estimate(loads, balances, contact, systems_->momentum && (refined || wanted), systems_->heat && (warmed || wanted));
  cost_.substitutions -= substitutions() - before;
  ++cost_.estimates;
  return balances;
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
