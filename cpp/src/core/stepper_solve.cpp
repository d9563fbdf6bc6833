// The solves of a step: right-hand sides, contact forces, heat, and the way in and out of the coupled system.
#include "timed.hpp"
#include "warmslip/contact_share.hpp"
#include "warmslip/stepper.hpp"

namespace warmslip {
namespace {

// out -= factor a x, through `scratch`; nothing when there is no such operator.
void subtract(Mat a, double factor, Vec x, Vec scratch, Vec out) {
  if (!a) return;
  WARMSLIP_PETSC(MatMult(a, x, scratch));
  WARMSLIP_PETSC(VecAXPY(out, -factor, scratch));
}

}  // namespace

template <int d>
void Stepper<d>::products(Level& level) const {
  multiply(operators_.inertia, level.w, level.momentum);
  multiply(operators_.elasticity, level.u, level.elastic_u);
  multiply(operators_.mass, level.theta, level.mass_theta);
  if (level.expansion_theta) multiply(operators_.expansion, level.theta, level.expansion_theta);
  if (surface_.points() > 0) level.contact_u = surface_.at_points(surface_.nodal_values(level.u));
  if (reactive()) level.contact_theta = surface_.scalar_shape() * surface_.nodal_values(level.theta);
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
  const auto less = [&](Mat a, double factor, Vec x) { subtract(a, factor, x, correction_w_, out); };
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
  const auto less = [&](Mat a, double factor, Vec x) { subtract(a, factor, x, correction_theta_, out); };
  if (loads.support_temperature) {
    less(operators_.mass, 1 / options_.k, loads.support_temperature);
    less(operators_.conductivity, 1, loads.support_temperature);
    less(operators_.exchange, 1, loads.support_temperature);
  }
  if (monolithic() && loads.support_velocity) less(operators_.heating, -1, loads.support_velocity);
  fix(out, operators_.cooled, loads.support_temperature, 1 / scale);
}

// The free velocities of the contact points for a right-hand side, which is remembered.
template <int d>
Eigen::VectorXd Stepper<d>::reduce(Vec right) {
  const Eigen::VectorXd nodal = momentum_->reduce(right);
  return contact_ ? surface_.at_points(nodal) : Eigen::VectorXd();
}

template <int d>
bool Stepper<d>::solve_contact(const StepLoads& loads, const Eigen::VectorXd& free, const Eigen::VectorXd& guess,
                               ContactSolution<d>& solution) {
  const Timed timed(cost_.contact_seconds);
  const ContactProblem<d> problem =
      contact_problem(problem_, surface_, options_.k, now_.contact_u, loads.gap, free, contact_->scale(free));
  solution = contact_->solve(problem, guess);
  if (solution.converged && surface_.points() > surface_.nodes())
    share_least(problem, surface_.scalar_shape(), options_.contact.tolerance, solution);
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

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
