// The solves of a step: right-hand sides, contact forces, heat, and the way in and out of the coupled system.
#include "warmslip/contact/minimal_forces.hpp"
#include "warmslip/fem/supports.hpp"
#include "warmslip/time/stepper.hpp"
#include "warmslip/time/timer.hpp"

namespace warmslip {
namespace {

// out -= factor a x, through `scratch`; nothing when there is no such operator.
void subtract(Mat a, double factor, Vec x, Vec scratch, Vec out) {
  if (!a) return;
  WARMSLIP_PETSC(MatMult(a, x, scratch));
  WARMSLIP_PETSC(VecAXPY(out, -factor, scratch));
}

// The largest entry of this rank.
double largest_here(Vec v) {
  if (!v) return 0;
  Values values(v);
  const auto entries = *values;
  return entries.size() ? entries.lpNorm<Eigen::Infinity>() : 0;
}

// The largest magnitudes by axis of this rank, found for several nodes at once.
template <int d>
Eigen::Vector3d reach_here(Vec v) {
  constexpr int wide = 8 * d;
  Values values(v);
  const auto entries = *values;
  Eigen::Array<double, wide, 1> largest = Eigen::Array<double, wide, 1>::Zero();
  Eigen::Index i = 0;
  for (; i + wide <= entries.size(); i += wide) largest = largest.max(entries.template segment<wide>(i).array().abs());
  for (; i < entries.size(); ++i) largest[i % d] = std::max(largest[i % d], std::abs(entries[i]));
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();
  reach.head(d) = largest.reshaped(d, wide / d).rowwise().maxCoeff();
  return reach;
}

}  // namespace

template <int d>
void Stepper<d>::products(TimeLevel& level) const {
  multiply(operators_.inertia, level.w, level.momentum);
  if (level.elastic_u) multiply(operators_.elasticity, level.shape(), level.elastic_u);
  if (level.sprung) {  // the rigid motion strains springs alone
    WARMSLIP_PETSC(VecWAXPY(beside_shape_, -1, level.strained, level.u));
    WARMSLIP_PETSC(MatMultAdd(operators_.springs, beside_shape_, level.elastic_u, level.elastic_u));
    WARMSLIP_PETSC(MatMult(operators_.springs, level.u, level.sprung));
  }
  multiply(operators_.mass, level.theta, level.mass_theta);
  if (level.expansion_theta) {
    const double from = operators_.common_reference;
    if (from != 0) WARMSLIP_PETSC(VecCopy(level.theta, warmer_));
    if (from != 0) WARMSLIP_PETSC(VecShift(warmer_, -from));
    multiply(operators_.expansion, from != 0 ? warmer_ : level.theta, level.expansion_theta);
  }
  const Eigen::Vector3d reach = reach_here<d>(level.u);
  const auto largest = over_ranks(
      layout_.comm(), std::array{largest_here(level.strained), largest_here(level.w), largest_here(level.strained_w),
                                 largest_here(level.theta), reach[0], reach[1], reach[2]});
  level.reach = {largest[4], largest[5], largest[6]};
  level.sizes = {level.strained ? largest[0] : level.reach.maxCoeff(), largest[1],
                 level.strained_w ? largest[2] : largest[1], largest[3]};
  if (surface_.points() > 0) level.contact_u = surface_.at_points(surface_.nodal_values(level.u));
}

// The fixed entries of a right-hand side: scale times the given ones, or zero.
template <int d>
void Stepper<d>::fix(Vec v, const std::vector<PetscInt>& indices, Vec given, double scale) {
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(v, &begin, &end));
  Values values(v), known(given);
  for (const PetscInt i : indices) (*values)[i - begin] = given ? scale * (*known)[i - begin] : 0;
}

// f + rho M w_{n-1} / k - A u_{n-1} + G theta_{n-1}, less what moving supports pull
template <int d>
void Stepper<d>::momentum_right_side(const StepLoads& loads, const Eigen::VectorXd& from) {
  const double k = systems_->k;
  const Vec out = momentum_right_;
  WARMSLIP_PETSC(VecCopy(loads.force, out));
  if (now_.momentum && systems_->rigid.empty()) WARMSLIP_PETSC(VecAXPY(out, 1 / k, now_.momentum));
  if (now_.momentum && !systems_->rigid.empty()) {
    const Vec seen = next_.strained_w;
    WARMSLIP_PETSC(VecCopy(now_.strained_w, seen));
    systems_->rigid.carry(now_.rigid - from, seen);
    multiply(operators_.inertia, seen, correction_w_);
    WARMSLIP_PETSC(VecAXPY(out, 1 / k, correction_w_));
  }
  const auto less = [&](Mat a, double factor, Vec x) { subtract(a, factor, x, correction_w_, out); };
  if (loads.support_velocity) less(operators_.inertia, 1 / k, loads.support_velocity);
  if (systems_->sprung && !from.isZero(0)) {  // what is seen from a motion has springs that it strains
    const Vec seen = next_.strained_w;
    WARMSLIP_PETSC(VecSet(seen, 0));
    systems_->rigid.carry(from, seen);
    less(operators_.springs, k, seen);
    less(operators_.dashpots, 1, seen);
  }
  if (momentum_external_) WARMSLIP_PETSC(VecCopy(out, momentum_external_));
  if (systems_->sprung) {
    if (now_.sprung) WARMSLIP_PETSC(VecAXPY(momentum_external_, -1, now_.sprung));
    if (loads.support_velocity) {
      subtract(operators_.springs, k, loads.support_velocity, correction_w_, momentum_external_);
      subtract(operators_.dashpots, 1, loads.support_velocity, correction_w_, momentum_external_);
    }
  }
  if (now_.elastic_u) WARMSLIP_PETSC(VecAXPY(out, -1, now_.elastic_u));
  if (!monolithic() && now_.expansion_theta) WARMSLIP_PETSC(VecAXPY(out, 1, now_.expansion_theta));
  if (loads.support_velocity) {
    less(operators_.viscosity, 1, loads.support_velocity);
    less(operators_.elasticity, k, loads.support_velocity);
  }
  if (monolithic() && loads.support_temperature) less(operators_.expansion, -1, loads.support_temperature);
  if (monolithic() && operators_.common_reference != 0) WARMSLIP_PETSC(VecAXPY(out, -1, operators_.reference));
  hold(out, loads.support_velocity);
}

// The held directions of a right-hand side of the motion: the given velocity, or zero.
template <int d>
void Stepper<d>::hold(Vec v, Vec given) const {
  release(layout_, operators_.prescribed_displacement, operators_.inclined, v);
  if (!given) return;
  fix(v, operators_.prescribed_displacement, given);
  const PetscInt first = layout_.owned() ? layout_.global_nodes()[0] : 0;
  Values values(v), known(given);
  for (std::size_t i = 0; i < operators_.inclined.size(); ++i) {
    const HeldNode<d>& one = operators_.inclined[i];
    if (!owns(layout_, one.node)) continue;
    const PetscInt at = (layout_.global_of(one.node) - first) * d;
    (*values).template segment<d>(at) +=
        systems_->support_scales[static_cast<Eigen::Index>(i)] * (one.held * (*known).template segment<d>(at)).eval();
  }
}

// Gives the nodes in inclined guides what those prescribe of their velocity: the operator holds them up to rounding of
// the largest one, which is no motion where a body comes to rest. Rigid motions that are solved for apart run along the
// guides, and what strains is corrected alone.
template <int d>
void Stepper<d>::guide(Vec given) const {
  const PetscInt first = layout_.owned() ? layout_.global_nodes()[0] : 0;
  const bool apart = !systems_->rigid.empty();
  Values strains(apart ? next_.strained_w : next_.w), known(given), whole(apart ? Vec(next_.w) : nullptr);
  for (const HeldNode<d>& one : operators_.inclined) {
    if (!owns(layout_, one.node)) continue;
    const PetscInt at = (layout_.global_of(one.node) - first) * d;
    Point<d> over = (*strains).template segment<d>(at);
    if (given) over -= (*known).template segment<d>(at);
    over = (one.held * over).eval();
    (*strains).template segment<d>(at) -= over;
    if (apart) (*whole).template segment<d>(at) -= over;
  }
}

// q + M theta_{n-1} / k + E w, less what warm supports conduct; `scale` is that of the heat rows
template <int d>
void Stepper<d>::heat_right_side(const StepLoads& loads, Vec heating_w, double scale) {
  const Vec out = heat_right_;
  WARMSLIP_PETSC(VecCopy(loads.heat, out));
  WARMSLIP_PETSC(VecAXPY(out, 1 / systems_->k, now_.mass_theta));
  if (heating_w) WARMSLIP_PETSC(VecAXPY(out, 1, heating_w));
  const auto less = [&](Mat a, double factor, Vec x) { subtract(a, factor, x, correction_theta_, out); };
  if (loads.support_temperature) {
    less(operators_.mass, 1 / systems_->k, loads.support_temperature);
    less(operators_.conductivity, 1, loads.support_temperature);
    less(operators_.exchange, 1, loads.support_temperature);
  }
  if (monolithic() && loads.support_velocity) less(operators_.heating, -1, loads.support_velocity);
  fix(out, operators_.prescribed_temperature, loads.support_temperature, 1 / scale);
}

// The free velocities of the contact points for a right-hand side, which is remembered with the load on the motions
// that are solved for apart; `external` is the part of it that acts on those.
template <int d>
Eigen::VectorXd Stepper<d>::reduce(Vec right, Vec external) {
  const Eigen::VectorXd nodal = systems_->momentum->reduce(right);
  rigid_load_ = systems_->rigid.apart() ? systems_->rigid.load(external, right) : Eigen::VectorXd();
  return systems_->contact ? surface_.at_points(nodal) : Eigen::VectorXd();
}

// Velocities of the contact points relative to the foundation, (d points).
template <int d>
Eigen::VectorXd Stepper<d>::sliding(Vec w) const {
  return surface_.at_points(surface_.nodal_values(w)) - drive_;
}

// Gives the contact nodes that are also points the velocity of their law, in w; `moved` has the same change. Rounding
// of the free velocity would else be that of a penetration far smaller.
template <int d>
void Stepper<d>::apply_contact_velocity(const ContactSolution<d>& contact, Vec w, Vec moved) const {
  std::vector<Eigen::Index> closed;
  for (Eigen::Index i = 0; i < surface_.points(); ++i)
    if (surface_.own_node(i) >= 0 && contact.status[static_cast<std::size_t>(i)] != Status::open) closed.push_back(i);
  if (closed.empty()) return;
  const Eigen::VectorXd nodal = surface_.nodal_values(w);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(nodal.size());
  for (const Eigen::Index i : closed) {
    const Eigen::Index node = surface_.own_node(i);
    const auto point = static_cast<std::size_t>(i);
    const Point<d> velocity = nodal.segment<d>(node * d) - drive_.segment<d>(i * d);
    change.segment<d>(node * d) =
        settled<d>(posed_.law(point), posed_.points[point], systems_->k, contact.status[point],
                   contact.force.template segment<d>(i * d), posed_.free.template segment<d>(i * d), velocity) -
        velocity;
  }
  if (change.isZero(0)) return;
  change = surface_.released(change);
  surface_.add(change, w);
  if (moved) surface_.add(change, moved);
}

// The velocity and, monolithic, the temperature for the right-hand side of the last `reduce` and the forces of the
// contact. Without supports, `w` lacks the rigid motions, which are returned.
template <int d>
Eigen::VectorXd Stepper<d>::expand(const ContactSolution<d>& contact, Vec w, Vec theta) {
  const Vec out = monolithic() ? Vec(coupled_) : w;
  systems_->momentum->expand(systems_->contact ? surface_.to_nodes(contact.force) : Eigen::VectorXd(), out);
  Eigen::VectorXd motions;
  if (systems_->rigid.apart()) {
    motions = systems_->contact ? contact.rigid : systems_->rigid.alone(rigid_load_);
    systems_->rigid.strain(motions, out);
  }
  if (monolithic()) split(coupled_, w, theta);
  if (!systems_->rigid.empty() && !systems_->rigid.apart()) motions = systems_->rigid.remove(w);
  return motions;
}

template <int d>
bool Stepper<d>::solve_contact(const Eigen::VectorXd& guess, ContactSolution<d>& solution) {
  const WallTimed timed(cost_.contact_seconds);
  solution = systems_->contact->solve(posed_, guess);
  if (solution.converged && surface_.shares())
    minimal_forces(posed_, surface_.moving_shape(), options_.contact.tolerance, solution);
  for (Eigen::Index i = 0; solution.converged && i < surface_.points(); ++i) {  // a guide bears what friction need not
    const Point<d> along = surface_.held_along(i, solution.velocity.template segment<d>(i * d));
    if (along.norm() > 1e-14 * largest_entry(free_)) continue;
    const Point<d> borne = surface_.held_along(i, solution.force.template segment<d>(i * d));
    solution.force.template segment<d>(i * d) -= borne;
    solution.added.template segment<d>(i * d) -= borne;
  }
  // every rank solved the same small problem; let them agree to the last bit
  MPI_Bcast(solution.force.data(), static_cast<int>(solution.force.size()), MPI_DOUBLE, 0, layout_.comm());
  MPI_Bcast(solution.added.data(), static_cast<int>(solution.added.size()), MPI_DOUBLE, 0, layout_.comm());
  MPI_Bcast(solution.rigid.data(), static_cast<int>(solution.rigid.size()), MPI_DOUBLE, 0, layout_.comm());
  int found[] = {solution.converged, solution.unsupported, solution.undetermined};
  MPI_Bcast(found, 3, MPI_INT, 0, layout_.comm());
  solution.converged = found[0] != 0;
  solution.unsupported = found[1] != 0;
  solution.undetermined = found[2] != 0;
  solution.status.resize(posed_.points.size(), Status::open);
  MPI_Bcast(solution.status.data(), static_cast<int>(solution.status.size()), MPI_SIGNED_CHAR, 0, layout_.comm());
  cost_.newton_iterations += solution.iterations;
  cost_.dense_factorizations += solution.factorizations;
  return solution.converged;
}

// Velocity (and, monolithic, temperature) of the step. Returns whether contact was solved for. A body without supports
// is seen from its rigid motion so far, whose digits are then none of its own. Where contact stops it in a long step
// the two motions cancel, and it is seen from rest.
template <int d>
bool Stepper<d>::solve_motion(const StepLoads& loads, ContactSolution<d>& contact) {
  Eigen::VectorXd from = now_.rigid;
  if (!reach_motion(loads, from, contact)) {
    if (from.isZero(0) || !in_range(free_)) return false;
    from.setZero();
    if (!reach_motion(loads, from, contact)) return false;
  }
  const WallTimed part(cost_.momentum_seconds);
  if (systems_->rigid.empty()) {
    expand(contact, next_.w, next_.theta);
  } else {
    next_.rigid = from + expand(contact, next_.strained_w, next_.theta);
    WARMSLIP_PETSC(VecCopy(next_.strained_w, next_.w));
    systems_->rigid.carry(next_.rigid, next_.w);
  }
  if (systems_->contact) apply_contact_velocity(contact, next_.w, next_.strained_w);
  guide(loads.support_velocity);
  return true;
}

// The contact of the step, seen from the rigid motion `from`.
template <int d>
bool Stepper<d>::reach_motion(const StepLoads& loads, const Eigen::VectorXd& from, ContactSolution<d>& contact) {
  {
    const WallTimed part(cost_.momentum_seconds);
    momentum_right_side(loads, from);
    if (monolithic()) {
      heat_right_side(loads, nullptr, systems_->coupled_scale);
      join(momentum_right_, heat_right_, coupled_right_);
    }
    free_ = reduce(monolithic() ? coupled_right_ : momentum_right_, momentum_external_);
    if (systems_->contact && !systems_->rigid.empty()) free_ += systems_->carried * from;
    if (systems_->contact) free_ -= drive_;
  }
  if (!systems_->contact) return true;
  if (!in_range(free_)) return false;
  posed_ = contact_problem(problem_, surface_, systems_->k, now_.contact_u, loads.gap, free_, rigid_load_);
  return solve_contact(contact_force_, contact);
}

// Heat that the contact conducts or makes is known at the contact points alone: as power that a node loses by what it
// is warmer than the foundation beside it, less what it receives at that temperature, from friction say. Counted from
// zero the two would cancel where the contact conducts heat well.
template <int d>
typename Stepper<d>::NodalFlow Stepper<d>::flow(const StepLoads& loads, const Eigen::VectorXd& force,
                                                const Eigen::VectorXd& velocity) const {
  const auto& shape = surface_.scalar_shape();
  const ContactFlow at = contact_flow(problem_, surface_, force, velocity, free_);
  NodalFlow out{shape.transpose() * at.conductance.asDiagonal() * shape, {}};
  out.given =
      shape.transpose() * (at.conductance.cwiseProduct(loads.foundation - shape * beside_) + at.friction).eval();
  for (Eigen::Index i = 0; i < out.given.size(); ++i)
    if (fixed_contact_[static_cast<std::size_t>(i)]) {  // a held temperature takes any flow
      out.lost.row(i).setZero();
      out.given[i] = 0;
    }
  return out;
}

template <int d>
void Stepper<d>::solve_heat(const StepLoads& loads, Vec heating_w) {
  const WallTimed timed(cost_.heat_seconds);
  heat_right_side(loads, heating_w, 1);
  if (heat_external_) WARMSLIP_PETSC(VecCopy(heat_right_, heat_external_));
  if (reactive()) {
    beside_ = surface_.nodal_mean(loads.foundation);
    flow_ = flow(loads, next_.contact_force, sliding(next_.w));
  }
  solve_heat(heat_right_, heat_external_, flow_.given, beside_, next_.theta);
}

// The temperatures theta_c = beside + t of the contact nodes, free - C (flow t - given) + W_c a with the constants a
// that are solved for apart, are found from a dense linear system, as the contact forces are.
template <int d>
void Stepper<d>::solve_heat(Vec right, Vec external, const Eigen::VectorXd& given, const Eigen::VectorXd& beside,
                            Vec out) {
  const Eigen::VectorXd free = systems_->heat->reduce(right);
  const Eigen::Index m = systems_->constants.count();
  const Eigen::VectorXd load = m > 0 ? systems_->constants.load(external, right) : Eigen::VectorXd();
  if (!reactive()) {
    systems_->heat->expand(Eigen::VectorXd::Zero(free.size()), out);
    if (m > 0) {
      const Eigen::VectorXd constants = systems_->constants.alone(load);
      systems_->constants.strain(constants, out);
      systems_->constants.carry(constants, out);
    }
    return;
  }
  const Eigen::Index n = free.size();
  const Eigen::MatrixXd& compliance = systems_->heat->compliance();
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n + m, n + m);
  Eigen::VectorXd loads(n + m);
  system.topLeftCorner(n, n) += compliance * flow_.lost;
  loads.head(n) = free - beside + compliance * given;
  if (m > 0) {
    Eigen::MatrixXd along(n, m);
    for (Eigen::Index j = 0; j < m; ++j) along.col(j) = surface_.nodal_values(systems_->constants.along(j));
    system.topRightCorner(n, m) = -along;
    system.bottomLeftCorner(m, n) = along.transpose() * flow_.lost;
    system.bottomRightCorner(m, m) = systems_->constants.inertia();
    loads.tail(m) = load + along.transpose() * given;
  }
  const Eigen::VectorXd found = system.partialPivLu().solve(loads);
  systems_->heat->expand(flow_.lost * found.head(n) - given, out);
  if (m > 0) {
    systems_->constants.strain(found.tail(m), out);
    systems_->constants.carry(found.tail(m), out);
  }
}

template <int d>
void Stepper<d>::join(Vec momentum, Vec heat, Vec coupled) const {
  Values m(momentum), h(heat), c(coupled);
  for (PetscInt i = 0; i < layout_.owned(); ++i) {
    (*c).template segment<d>(i * (d + 1)) = (*m).template segment<d>(i * d);
    (*c)[i * (d + 1) + d] = systems_->coupled_scale * (*h)[i];
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

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
