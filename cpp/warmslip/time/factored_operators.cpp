// What a stepper holds for all steps: factored operators, the contact solver, vectors of the fields there are.
#include "warmslip/time/stepper.hpp"
#include "warmslip/time/timer.hpp"

namespace warmslip {
namespace {

double largest_diagonal(Mat a) {
  if (!a) return 0;
  VecHandle diagonal;
  PetscReal largest = 0;
  WARMSLIP_PETSC(MatCreateVecs(a, diagonal.out(), nullptr));
  WARMSLIP_PETSC(MatGetDiagonal(a, diagonal));
  WARMSLIP_PETSC(VecNorm(diagonal, NORM_INFINITY, &largest));
  return largest;
}

// The largest of a quantity of the materials at every node of the mesh.
template <int d, class Quantity>
Eigen::VectorXd at_nodes(const Problem<d>& problem, Quantity&& quantity) {
  const Mesh<d>& mesh = *problem.mesh;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(mesh.nodes.rows());
  for (Index cell = 0; cell < mesh.cells.rows(); ++cell) {
    const double here = quantity(problem.material(cell));
    for (const Index node : mesh.cells.row(cell)) out[node] = std::max(out[node], here);
  }
  return out;
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
      evaluator_(layout, problem, operators, surface) {
  if (!(options.k > 0) || !std::isfinite(options.k))
    throw std::invalid_argument("the time step must be positive and finite");
  const Timed timed(cost_.setup_seconds);
  if (!problem.moves() && !problem.conducts()) throw std::invalid_argument("a problem needs motion or heat");
  try {
    take_factors();
  } catch (const SolveFailed& failure) {  // before the first step: refused
    throw std::invalid_argument(failure.what());
  }
  take_vectors();
  cost_.factorizations = (momentum_ ? 1 : 0) + (heat_ ? 1 : 0);
  cost_.factor_bytes = (momentum_ ? momentum_->bytes() : 0) + (heat_ ? heat_->bytes() : 0);
}

template <int d>
std::vector<std::string> Stepper<d>::parts_in_contact(bool mechanical) const {
  std::vector<std::string> names;
  for (const ContactPart& contact : problem_.contacts)
    if (contact.law || !mechanical) names.push_back(contact.part);
  return names;
}

// Factors the operator of the motion, of `width` unknowns a node, with the rigid motions solved for apart.
template <int d>
void Stepper<d>::take_motion(Mat a, int width, Symmetry symmetry, const std::string& name) {
  if (operators_.elasticity || operators_.viscosity)
    rigid_ = RigidMotions(layout_, d, width, problem_.prescribed_displacement, parts_in_contact(true),
                          at_nodes(problem_, [&](const Material<d>& m) {
                            return (m.elasticity ? options_.k * m.elasticity->norm() : 0) +
                                   (m.viscosity ? m.viscosity->norm() : 0);
                          }));
  if (!rigid_.empty()) rigid_.add_springs(a);
  momentum_ = factor(a, surface_.unknowns(width), symmetry, width, name, options_.backend);
  if (rigid_.empty()) return;
  rigid_.prepare(*momentum_, [&](Vec x, Vec y) {
    multiply(operators_.inertia, x, y);
    WARMSLIP_PETSC(VecScale(y, 1 / options_.k));
  });
  if (symmetry == Symmetry::definite_or_refused && !rigid_.holds()) throw std::invalid_argument(indefinite_coupling);
  evaluator_.rigid_share(rigid_.share());
}

template <int d>
void Stepper<d>::take_factors() {
  const double k = options_.k;
  const bool moves = problem_.moves(), conducts = problem_.conducts();
  if (options_.coupling == Coupling::monolithic && moves && conducts) {
    if (problem_.contact_heats())
      throw std::invalid_argument("heat that the contact makes or conducts needs the staggered or the lagged coupling");
    auto [scale, symmetry] = coupled_symmetry(problem_);
    coupled_scale_ = scale;
    const MatHandle a = coupled_matrix(layout_, problem_, operators_, k, scale);
    take_motion(a, d + 1, symmetry, "coupled");
  } else {
    if (moves) {
      const MatHandle a = momentum_matrix(layout_, problem_, operators_, k);
      take_motion(a, d, Symmetry::positive_definite, "momentum");
    }
    if (conducts) {
      const MatHandle h = heat_matrix(operators_, k);
      // a capacity and an exchange that hold the constant temperature beside the conduction need no help
      const double storing = largest_diagonal(operators_.mass) / k + largest_diagonal(operators_.exchange);
      if (storing < 0.1 * largest_diagonal(operators_.conductivity))
        constants_ = RigidMotions(
            layout_, 1, 1, problem_.prescribed_temperature, parts_in_contact(false),
            at_nodes(problem_, [](const Material<d>& m) { return m.conductivity ? m.conductivity->norm() : 0; }));
      if (!constants_.empty()) constants_.add_springs(h);
      const auto apart = problem_.contact_heats() ? surface_.global_nodes() : std::vector<PetscInt>{};
      heat_ = factor(h, apart, problem_.conducts_symmetrically() ? Symmetry::positive_definite : Symmetry::general, 1,
                     "heat", options_.backend);
      if (!constants_.empty())
        constants_.prepare(*heat_, [&](Vec x, Vec y) {
          if (operators_.exchange) WARMSLIP_PETSC(MatMult(operators_.exchange, x, y));
          const VecHandle stored = duplicate(y);
          WARMSLIP_PETSC(MatMult(operators_.mass, x, stored));
          WARMSLIP_PETSC(VecAXPY(y, 1 / k, stored));
        });
    }
  }
  if (surface_.points() == 0) return;
  ContactOptions contact = options_.contact;
  // forces are shared in many ways, see ContactSolver::shared and minimal_forces
  if (surface_.shares()) contact.proximal = 1e-6;
  RigidCoupling apart{Eigen::MatrixXd(surface_.points() * d, rigid_.count()), {}, rigid_.inertia()};
  apart.loads = carried_ = apart.motions;
  for (Eigen::Index j = 0; j < rigid_.count(); ++j) {
    apart.motions.col(j) = surface_.at_points(surface_.nodal_values(rigid_.along(j)));
    apart.loads.col(j) = surface_.at_points(surface_.nodal_values(rigid_.along_transposed(j)));
    carried_.col(j) = surface_.at_points(surface_.nodal_values(rigid_.motion(j)));
  }
  contact_ = std::make_unique<ContactSolver<d>>(surface_.at_points(momentum_->compliance()), contact, std::move(apart));
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
    if (!rigid_.empty())
      for (VecHandle* v : {&level->strained, &level->strained_w}) *v = layout_.vector(d);
    level->rigid = Eigen::VectorXd::Zero(rigid_.count());
    if (operators_.expansion && moves) level->expansion_theta = layout_.vector(d);
    if (operators_.heating && moves) level->heating_w = layout_.vector(1);
    level->contact_force = Eigen::VectorXd::Zero(surface_.points() * d);
  }
  if (moves)
    for (VecHandle* v : {&momentum_right_, &correction_w_}) *v = layout_.vector(d);
  if (conducts)
    for (VecHandle* v : {&heat_right_, &correction_theta_}) *v = layout_.vector(1);
  if (!rigid_.empty())
    for (VecHandle* v : {&momentum_external_, &correction_strained_}) *v = layout_.vector(d);
  if (!constants_.empty()) heat_external_ = layout_.vector(1);
  if (moves && conducts && options_.coupling == Coupling::monolithic)
    for (VecHandle* v : {&coupled_right_, &coupled_}) *v = layout_.vector(d + 1);
  if (reactive()) {
    Eigen::VectorXd held = Eigen::VectorXd::Zero(layout_.mesh().nodes.rows());
    for (const PetscInt i : operators_.prescribed_temperature) held[i] = 1;
    held = layout_.sum(std::move(held));
    for (const PetscInt i : surface_.global_nodes()) fixed_contact_.push_back(held[i] > 0);
  }
  contact_force_ = Eigen::VectorXd::Zero(surface_.points() * d);
  status_.assign(static_cast<std::size_t>(surface_.points()), Status::open);
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
