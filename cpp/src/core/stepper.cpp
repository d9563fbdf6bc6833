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
// strong, quasi-definite for c < 0 (Vanderbei, SIAM J. Optim. 5, 1995). Of several materials all must have the same c.
template <int d>
std::pair<double, Symmetry> coupled_symmetry(const Problem<d>& problem) {
  double product = 0, expansion = 0;
  bool conducts_symmetrically = true;
  for (const Material<d>& m : problem.materials) {
    if (m.expansion) expansion += m.expansion->squaredNorm();
    if (m.expansion && m.heating) product += m.heating->cwiseProduct(*m.expansion).sum();
    if (m.conductivity) conducts_symmetrically &= m.conductivity->isApprox(m.conductivity->transpose());
  }
  const double c = expansion > 0 ? product / expansion : 0;
  const Symmetry uncoupled = conducts_symmetrically ? Symmetry::positive_definite : Symmetry::general;
  bool any = false;
  for (const Material<d>& m : problem.materials) {
    const Tensor2<d> heating = m.heating.value_or(Tensor2<d>::Zero()),
                     stress = m.expansion.value_or(Tensor2<d>::Zero());
    any = any || !heating.isZero(0) || !stress.isZero(0);
    if ((heating - c * stress).norm() > 1e-14 * heating.norm()) return {1, Symmetry::general};
  }
  if (!any) return {1, uncoupled};
  if (c == 0 || !conducts_symmetrically) return {1, Symmetry::general};
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
  const bool moves = problem.moves(), conducts = problem.conducts();
  if (!moves && !conducts) throw std::invalid_argument("a problem needs motion or heat");
  if (options.coupling == Coupling::monolithic && moves && conducts) {
    if (problem.contact_heats())
      throw std::invalid_argument("heat that the contact makes or leads needs the staggered or the lagged coupling");
    auto [scale, symmetry] = coupled_symmetry(problem);
    coupled_scale_ = scale;
    const MatHandle a = coupled_matrix(layout, problem, operators, options.k, scale);
    momentum_ = factor(a, surface.unknowns(d + 1), symmetry, d + 1, "coupled", options.backend);
    coupled_right_ = layout.vector(d + 1);
    coupled_ = layout.vector(d + 1);
  } else {
    if (moves) {
      const MatHandle a = momentum_matrix(layout, problem, operators, options.k);
      momentum_ = factor(a, surface.unknowns(d), Symmetry::positive_definite, d, "momentum", options.backend);
    }
    if (conducts) {
      const MatHandle h = heat_matrix(operators, options.k);
      bool symmetric = true;
      for (const auto& m : problem.materials)
        symmetric &= !m.conductivity || m.conductivity->isApprox(m.conductivity->transpose());
      const auto apart = problem.contact_heats() ? surface.global_nodes() : std::vector<PetscInt>{};
      heat_ = factor(h, apart, symmetric ? Symmetry::positive_definite : Symmetry::general, 1, "heat", options.backend);
    }
  }
  if (surface.points() > 0) {
    ContactOptions contact = options.contact;
    // more contact points than nodes: sticking forces are shared arbitrarily, see ContactSolver::factor
    if (surface.points() > surface.nodes()) contact.proximal = 1e-8;
    try {
      contact_ = std::make_unique<ContactSolver<d>>(surface.at_points(momentum_->compliance()), contact);
    } catch (const SolveFailed& failure) {  // before the first step: refused
      throw std::invalid_argument(failure.what());
    }
  }
  for (Level* level : {&now_, &next_}) {
    if (moves) {
      level->u = layout.vector(d);
      level->w = layout.vector(d);
    }
    if (conducts) {
      level->theta = layout.vector(1);
      level->mass_theta = layout.vector(1);
    }
    if (operators.inertia) level->momentum = layout.vector(d);
    if (operators.elasticity) level->elastic_u = layout.vector(d);
    if (operators.expansion && moves) level->expansion_theta = layout.vector(d);
    if (operators.heating && moves) level->heating_w = layout.vector(1);
  }
  if (moves)
    for (VecHandle* v : {&momentum_right_, &correction_w_}) *v = layout.vector(d);
  if (conducts)
    for (VecHandle* v : {&heat_right_, &correction_theta_}) *v = layout.vector(1);
  if (reactive()) {
    Eigen::VectorXd held = Eigen::VectorXd::Zero(layout.mesh().nodes.rows());
    for (const PetscInt i : operators.cooled) held[i] = 1;
    held = layout.sum(std::move(held));
    for (const PetscInt i : surface.global_nodes()) fixed_contact_.push_back(held[i] > 0);
  }
  contact_force_ = Eigen::VectorXd::Zero(surface.points() * d);
  status_.assign(static_cast<std::size_t>(surface.points()), Status::open);
  cost_.factorizations = (momentum_ ? 1 : 0) + (heat_ ? 1 : 0);
  cost_.factor_bytes = (momentum_ ? momentum_->bytes() : 0) + (heat_ ? heat_->bytes() : 0);
}

template <int d>
void Stepper<d>::products(Level& level) const {
  multiply(operators_.inertia, level.w, level.momentum);
  multiply(operators_.elasticity, level.u, level.elastic_u);
  multiply(operators_.mass, level.theta, level.mass_theta);
  if (level.expansion_theta) multiply(operators_.expansion, level.theta, level.expansion_theta);
  if (level.heating_w) multiply(operators_.heating, level.w, level.heating_w);
  if (surface_.points() > 0) level.contact_u = surface_.at_points(surface_.nodal_values(level.u));
  if (reactive()) level.contact_theta = surface_.scalar_shape() * surface_.nodal_values(level.theta);
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
void Stepper<d>::momentum_right_side(const StepLoads& loads) {
  const double k = options_.k;
  const Vec out = momentum_right_;
  WARMSLIP_PETSC(VecCopy(loads.force, out));
  if (now_.momentum) WARMSLIP_PETSC(VecAXPY(out, 1 / k, now_.momentum));
  if (now_.elastic_u) WARMSLIP_PETSC(VecAXPY(out, -1, now_.elastic_u));
  if (!monolithic() && now_.expansion_theta) WARMSLIP_PETSC(VecAXPY(out, 1, now_.expansion_theta));
  const auto less = [&](Mat a, double factor, Vec x) {
    if (!a) return;
    WARMSLIP_PETSC(MatMult(a, x, correction_w_));
    WARMSLIP_PETSC(VecAXPY(out, -factor, correction_w_));
  };
  if (loads.support_velocity) {
    less(operators_.inertia, 1 / k, loads.support_velocity);
    less(operators_.viscosity, 1, loads.support_velocity);
    less(operators_.elasticity, k, loads.support_velocity);
  }
  if (monolithic() && loads.support_temperature) less(operators_.expansion, -1, loads.support_temperature);
  fix(out, operators_.clamped, loads.support_velocity);
}

// q + M theta_{n-1} / k + E w, less what warm supports conduct; `scale` is that of the heat rows
template <int d>
void Stepper<d>::heat_right_side(const StepLoads& loads, Vec heating_w, double scale) {
  const Vec out = heat_right_;
  WARMSLIP_PETSC(VecCopy(loads.heat, out));
  WARMSLIP_PETSC(VecAXPY(out, 1 / options_.k, now_.mass_theta));
  if (heating_w) WARMSLIP_PETSC(VecAXPY(out, 1, heating_w));
  const auto less = [&](Mat a, double factor, Vec x) {
    if (!a) return;
    WARMSLIP_PETSC(MatMult(a, x, correction_theta_));
    WARMSLIP_PETSC(VecAXPY(out, -factor, correction_theta_));
  };
  if (loads.support_temperature) {
    less(operators_.mass, 1 / options_.k, loads.support_temperature);
    less(operators_.conductivity, 1, loads.support_temperature);
    less(operators_.exchange, 1, loads.support_temperature);
  }
  if (monolithic() && loads.support_velocity) less(operators_.heating, -1, loads.support_velocity);
  fix(out, operators_.cooled, loads.support_temperature, 1 / scale);
}

template <int d>
bool Stepper<d>::solve_contact(const StepLoads& loads, const Eigen::VectorXd& free, const Eigen::VectorXd& guess,
                               ContactSolution<d>& solution) {
  const Timed timed(cost_.contact_seconds);
  ContactProblem<d> problem{{}, options_.k, {}, free, contact_->scale(free)};
  for (const ContactPart& part : problem_.contacts) problem.laws.push_back(part.law.value_or(ContactLaw{}));
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), u = now_.contact_u.segment<d>(i * d);
    problem.points.push_back(
        {nu, surface_.weights()[i], u.dot(nu) - loads.gap[i], u, loads.gap[i], surface_.contact(i)});
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

// Heat that the contact leads or makes is known at the contact points alone: with the temperatures there, theta_c =
// free - C (flow), the flow is found from a dense linear system, as the contact force is.
template <int d>
void Stepper<d>::solve_heat(const StepLoads& loads, Vec heating_w) {
  const Timed timed(cost_.heat_seconds);
  heat_right_side(loads, heating_w, 1);
  if (!reactive()) {
    heat_->solve(heat_right_, next_.theta);
    return;
  }
  const auto& shape = surface_.scalar_shape();
  const Eigen::VectorXd free = heat_->reduce(heat_right_);
  const ContactFlow flow = contact_flow(problem_, surface_, surface_.at_points(surface_.nodal_values(next_.u)),
                                        surface_.at_points(surface_.nodal_values(next_.w)), loads.gap);
  // power a node loses: what is led at its temperature less what comes from the foundation and from friction
  Eigen::MatrixXd led = shape.transpose() * flow.conductance.asDiagonal() * shape;
  Eigen::VectorXd given = shape.transpose() * (flow.conductance.cwiseProduct(loads.foundation) + flow.friction).eval();
  for (Eigen::Index i = 0; i < given.size(); ++i)
    if (fixed_contact_[static_cast<std::size_t>(i)]) {  // a held temperature takes any flow
      led.row(i).setZero();
      given[i] = 0;
    }
  const Eigen::MatrixXd& compliance = heat_->compliance();
  const Eigen::MatrixXd tangent = Eigen::MatrixXd::Identity(free.size(), free.size()) + compliance * led;
  const Eigen::VectorXd theta = tangent.partialPivLu().solve(free + compliance * given);
  heat_->expand(led * theta - given, next_.theta);
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
  if (next_.w) WARMSLIP_PETSC(VecWAXPY(next_.u, options_.k, next_.w, now_.u));
  next_.gap = loads.gap;
  const Vec heating_w = options_.coupling == Coupling::lagged ? now_.heating_w : next_.heating_w;
  if (heat_) {
    if (heating_w && heating_w == next_.heating_w) multiply(operators_.heating, next_.w, next_.heating_w);
    solve_heat(loads, heating_w);
  }
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

// The free velocities of the contact points for a right-hand side, which is remembered.
template <int d>
Eigen::VectorXd Stepper<d>::reduce(Vec right) {
  const Eigen::VectorXd nodal = momentum_->reduce(right);
  return contact_ ? surface_.at_points(nodal) : Eigen::VectorXd();
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
      StepReport<d> report = not_taken<d>(finite ? Outcome::contact_not_converged : Outcome::not_finite);
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
  Ledger ledger = books_.close(now_, next_, inputs);
  if (momentum_ &&
      std::max({ledger.energy_residual, ledger.force_residual, monolithic() ? ledger.heat_residual : 0.0}) >
          options_.refinement &&
      refine(loads, inputs, contact))
    ledger = books_.close(now_, next_, complete(loads, contact));
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
  if (report.outcome == Outcome::precision_lost)
    report.reason =
        ledger.law_floor <= options_.floor_bound
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
