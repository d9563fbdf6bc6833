// How many digits of a step can be trusted: what rounding changes in it, and what those changes make of one another.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "warmslip/time/stepper.hpp"

namespace warmslip {
namespace {

constexpr int hard = 15;  // iterations of the contact solver from which on a step is measured

}  // namespace

double Errors::largest() const {
  double worst = 0;
  for (const double error : {u, theta, stress, contact_force})
    if (std::isgreater(error, worst)) worst = error;  // quiet about nan, also where it traps
  return worst;
}

template <int d>
void Stepper<d>::forget_errors() {
  errors_ = {};
  for (Extent* field : extents_.all()) field->tried = 0;
}

// Notes a change of a field: its error is relative to its largest value so far, taken to be no smaller than `least`. Of
// several the worst is kept.
template <int d>
void Stepper<d>::note(double& error, Extent& field, double change, double size, double least) {
  field.tried = std::max(field.tried, change);
  field.size = std::max(field.size, size);
  field.scale = std::max({field.scale, size, least});
  error = std::fmax(error, field.scale > 0 ? change / field.scale : 0);
}

template <int d>
void Stepper<d>::note_temperature(const Balances& balances) {
  note(errors_.theta, extents_.theta, largest_entry(correction_theta_), largest_entry(next_.theta),
       balances.temperature_scale);
}

// Adds the temperature that the estimated errors of velocity and contact force make, by straining and by what the
// contact leads and rubs, to the change of the temperature. It ends no run: where steps are long, the temperature may
// hardly feel the motion.
template <int d>
void Stepper<d>::add_heat_of_error(const StepLoads& loads) {
  if (!operators_.heating && !reactive()) return;
  WARMSLIP_PETSC(VecSet(heat_right_, 0));
  if (operators_.heating)
    multiply(operators_.heating, correction_strained_ ? correction_strained_ : correction_w_, heat_right_);
  fix(heat_right_, operators_.prescribed_temperature, nullptr);
  if (heat_external_) WARMSLIP_PETSC(VecCopy(heat_right_, heat_external_));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(flow_.given.size());
  Eigen::VectorXd given = none;
  if (reactive()) {
    const Eigen::VectorXd velocity = surface_.nodal_values(next_.w) + surface_.nodal_values(correction_w_),
                          warmer = surface_.nodal_values(next_.theta) - beside_;
    const NodalFlow there = flow(loads, next_.contact_force + correction_force_, surface_.at_points(velocity) - drive_);
    given = there.given - flow_.given - (there.lost - flow_.lost) * warmer;
  }
  solve_heat(heat_right_, heat_external_, given, none, correction_theta_);
  extents_.theta.tried += largest_entry(correction_theta_);
}

// Adds the motion that the estimated error of the temperature makes, which the next step takes as given: its thermal
// forces are in momentum_right_. It ends no run, as the heat of an error of the motion does not.
template <int d>
void Stepper<d>::add_motion_of_error(const ContactSolution<d>& contact) {
  hold(momentum_right_, nullptr);
  if (momentum_external_) WARMSLIP_PETSC(VecSet(momentum_external_, 0));  // they move no body as a whole
  const Eigen::VectorXd cause = reduce(momentum_right_, momentum_external_);
  ContactSolution<d> change = contact;
  if (systems_->contact) {
    posed_.rigid = rigid_load_;
    if (!respond(cause, {}, change)) return;
    change.force = change.added;
    extents_.contact_force.tried += largest_entry(surface_.to_nodes(change.force));
  }
  const Vec change_w = systems_->rigid.empty() ? correction_w_ : correction_strained_, change_u = momentum_right_;
  const Eigen::VectorXd motions = expand(change, change_w, nullptr);
  WARMSLIP_PETSC(VecCopy(change_w, change_u));
  WARMSLIP_PETSC(VecScale(change_u, systems_->k));
  extents_.stress.tried += stress_size(layout_, problem_, change_u, change_w).largest;
  if (!systems_->rigid.empty()) systems_->rigid.carry(systems_->k * motions, change_u);
  extents_.u.tried += largest_entry(change_u);
}

// Adds the thermal stress of the estimated error of the temperature, and of the rounding of its digits: a body near its
// reference temperature in kelvin has few of the difference.
template <int d>
void Stepper<d>::add_stress_of_temperature() {
  double expansion = 0;
  for (const Material<d>& material : problem_.materials)
    if (material.expansion) expansion = std::max(expansion, material.expansion->norm());
  extents_.stress.tried +=
      expansion * (extents_.theta.tried + 0.5 * std::numeric_limits<double>::epsilon() * next_.sizes.theta);
}

// Adds what a body without supports and springs drifts: the rounding of constant loads is the same in every step, and
// moves it by half the square of their number. Contact that leaves a part r of a motion in every step leaves r / (1 -
// r) of all. In a step that touches after one that did not, the drift before is over.
template <int d>
void Stepper<d>::add_drift(const Eigen::VectorXd& motions, bool lands) {
  if (motions.size() == 0 || !operators_.inertia || systems_->sprung) return;
  const double all = 0.5 * (taken_ + 1.0) * (taken_ + 1.0);
  Eigen::VectorXd drifts =
      systems_->rigid.alone(systems_->rigid.apart() ? rigid_load_ : systems_->rigid.of(momentum_external_));
  for (Eigen::Index i = 0; i < drifts.size(); ++i) {
    const double alone = std::abs(drifts[i]), left = std::min(std::abs(motions[i]), alone);
    drifts[i] *= lands || left == alone ? all : std::min(all, left / (alone - left));
  }
  const Vec drift = momentum_right_;
  WARMSLIP_PETSC(VecSet(drift, 0));
  systems_->rigid.carry(drifts, drift);
  extents_.u.tried += systems_->k * largest_entry(drift);
}

// The largest change of a nodal contact force if points stick whose slip is no larger than ten times its own error:
// their friction may point the other way. Zero where no slip is that small.
template <int d>
double Stepper<d>::change_at_rest(const Eigen::VectorXd& cause, const ContactSolution<d>& contact) {
  const Eigen::VectorXd velocity = sliding(next_.w), error = surface_.at_points(surface_.nodal_values(correction_w_));
  const auto across = [&](const auto& vectors, Eigen::Index i) -> Point<d> {
    const Point<d> nu = surface_.normals().row(i).transpose(), v = vectors.template segment<d>(i * d);
    return v - v.dot(nu) * nu;
  };
  std::vector<bool> resting;
  bool any = false;
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const auto point = static_cast<std::size_t>(i);
    resting.push_back(contact.status[point] == Status::slip && !surface_.prescribed(i) &&
                      posed_.law(point).friction.present() && posed_.law(point).friction.regularisation == 0 &&
                      across(velocity, i).norm() <= 10 * across(error, i).norm());
    any = any || resting.back();
  }
  ContactSolution<d> change = contact;
  if (!any || !respond(cause, resting, change)) return 0;
  const Eigen::VectorXd changed = surface_.to_nodes(change.added).cwiseAbs(),
                        borne = surface_.to_nodes(contact.force).cwiseAbs();
  double largest = 0;  // friction that turns round changes no force by more than twice what a node bears
  for (Eigen::Index i = 0; i < changed.size(); i += d)
    largest = std::max(largest, std::min(changed.segment<d>(i).maxCoeff(), 2 * borne.segment<d>(i).norm()));
  return largest;
}

// The largest change of a normal force at a point whose penetration has a force of its own, on a foundation that is not
// rigid: where forces can be shared so that no node feels it, a stiff one makes much of the rounding of a penetration.
template <int d>
double Stepper<d>::change_of_pressure(const Eigen::VectorXd& change, const ContactSolution<d>& contact) const {
  double largest = 0;
  for (Eigen::Index i = 0; surface_.shares() && i < surface_.points(); ++i) {
    const auto point = static_cast<std::size_t>(i);
    if (contact.status[point] == Status::open || posed_.law(point).compliance.rigid()) continue;
    const Point<d> nu = surface_.normals().row(i).transpose(), here = change.segment<d>(i * d);
    largest = std::max(largest, std::abs(here.dot(nu)));
  }
  return largest;
}

// What rounding of velocities and displacements does to the velocities of the points along their normals, (d points),
// to one side and the other in turn: a body that slides fast along an oblique foundation is pressed into it by
// rounding, and one that has just come to it in very short steps.
template <int d>
Eigen::VectorXd Stepper<d>::rounding(const Eigen::VectorXd& velocity) const {
  const Eigen::VectorXd sizes = velocity.cwiseAbs() + now_.contact_u.cwiseAbs() / systems_->k;
  Eigen::VectorXd out(velocity.size());
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), size = sizes.segment<d>(i * d);
    out.segment<d>(i * d) = (i % 2 ? 1 : -1) * std::numeric_limits<double>::epsilon() * size.dot(nu.cwiseAbs()) * nu;
  }
  return out;
}

// Estimates the errors of the motion and of the temperature, and what either makes of the other. The first sample of
// rounding decides whether a run stops, as it is likely to be; the worst one is in the digits. One is enough where it
// leaves ten digits of every field.
template <int d>
void Stepper<d>::estimate(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact, bool moved,
                          bool warmed) {
  evaluator_.store_magnitudes(now_, next_, inputs(loads, contact));
  forget_errors();
  const auto fields = extents_.all();
  const auto doubtful = [](const Extent* field) { return !(field->tried <= 1e-10 * field->size); };
  std::array<double, 4> worst{};
  Errors likely;
  for (int sample = 0; sample < rounding_samples; ++sample) {
    for (Extent* field : fields) field->tried = 0;
    if (moved && !undetermined_) undetermined_ = !correct_motion(loads, balances, contact, sample);
    if (undetermined_) errors_ = {.theta = monolithic() ? Errors::unknown : errors_.theta};
    if (warmed) correct_heat(inputs(loads, contact), balances, sample);
    if (moved && !undetermined_) {
      const bool strains = warmed && operators_.expansion;
      if (strains) multiply(operators_.expansion, correction_theta_, momentum_right_);
      if (systems_->heat) add_heat_of_error(loads);
      if (strains) add_motion_of_error(contact);
      if (operators_.expansion) add_stress_of_temperature();
    }
    for (std::size_t i = 0; i < fields.size(); ++i) worst[i] = std::max(worst[i], fields[i]->tried);
    if (sample == 0 || undetermined_) likely = errors_;
    int more = !undetermined_ && std::any_of(fields.begin(), fields.end(), doubtful);
    MPI_Bcast(&more, 1, MPI_INT, 0, layout_.comm());
    if (more == 0) break;
  }
  errors_ = likely;
  for (std::size_t i = 0; i < fields.size(); ++i) fields[i]->tried = worst[i];
  if (moved && operators_.inertia) add_coasting();
}

// Adds where the body has gone by the rounding of its largest velocity so far, which inertia keeps: that of a support
// that jumped in a short step, say.
template <int d>
void Stepper<d>::add_coasting() {
  const double way = std::numeric_limits<double>::epsilon() * std::max(extents_.speed, next_.sizes.straining) * time_,
               size = std::max(extents_.u.size, next_.sizes.u);
  extents_.u.tried += way;
  if (size > 0) extents_.stress.tried += extents_.stress.size * way / size;
}

// Whether the step that is being taken is one whose digits are measured anyway; counted from time zero, so that a run
// that goes on measures the same ones.
template <int d>
bool Stepper<d>::measured_now(const StepLoads& loads, const ContactSolution<d>& contact) const {
  const auto touching = [](const Eigen::VectorXd& force) {
    return (force.reshaped<Eigen::RowMajor>(force.size() / d, d).rowwise().squaredNorm().array() > 0).count();
  };
  if (loads.measured || touching(contact.force) > 2 * touching(now_.contact_force)) return true;
  if (contact.iterations > hard) return true;
  for (double step = 1, n = taken_ + 1; step <= n; step *= options_.measured_steps)
    if (step == n) return true;
  return false;
}

// Few steps estimate errors, and a field may be largest in any. The stress is looked at when u has doubled.
template <int d>
void Stepper<d>::note_sizes(const ContactSolution<d>& contact) {
  const auto grow = [](Extent& field, double size) {
    field.size = std::max(field.size, size);
    field.scale = std::max(field.scale, size);
  };
  grow(extents_.u, next_.sizes.u);
  grow(extents_.theta, next_.sizes.theta);
  extents_.speed = std::max(extents_.speed, next_.sizes.straining);
  if (next_.elastic_u && next_.sizes.u > 2 * extents_.looked) {
    extents_.looked = next_.sizes.u;
    grow(extents_.stress, stress_size(layout_, problem_, next_.shape(), next_.straining(), next_.theta).largest);
  }
  if (!systems_->contact || contact.force.size() == 0) return;
  grow(extents_.contact_force, contact.force.template lpNorm<Eigen::Infinity>());
  extents_.motion = extents_.motion.cwiseMax(next_.reach);
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
