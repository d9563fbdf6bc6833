// What a stepper holds for all steps: factored operators, the contact solver, vectors of the fields there are.
#include "timed.hpp"
#include "warmslip/stepper.hpp"

namespace warmslip {

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
      const auto apart = problem.contact_heats() ? surface.global_nodes() : std::vector<PetscInt>{};
      heat_ = factor(h, apart, problem.conducts_symmetrically() ? Symmetry::positive_definite : Symmetry::general, 1,
                     "heat", options.backend);
    }
  }
  if (surface.points() > 0) {
    ContactOptions contact = options.contact;
    // more contact points than nodes: sticking forces are shared in many ways, see ContactSolver::factor and
    // share_least
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

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
