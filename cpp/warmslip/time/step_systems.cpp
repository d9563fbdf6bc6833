#include "warmslip/time/step_systems.hpp"

#include <algorithm>

#include "warmslip/fem/supports.hpp"
#include "warmslip/time/roundoff.hpp"

namespace warmslip {
namespace {

VecHandle diagonal_of(Mat a) {
  VecHandle diagonal;
  WARMSLIP_PETSC(MatCreateVecs(a, diagonal.out(), nullptr));
  WARMSLIP_PETSC(MatGetDiagonal(a, diagonal));
  return diagonal;
}

double largest_diagonal(Mat a) {
  if (!a) return 0;
  PetscReal largest = 0;
  WARMSLIP_PETSC(VecNorm(diagonal_of(a), NORM_INFINITY, &largest));
  return largest;
}

// Whether the mass holds rigid motions to all but three digits: no diagonal entry exceeds a thousand times that of the
// node's mass.
bool mass_holds(Mat inertia, double k, int width, Mat a) {
  if (!inertia) return false;
  const VecHandle masses = row_sums(inertia), diagonal = diagonal_of(a);
  const Eigen::Index block = block_size(masses);
  Values entries(diagonal), held(masses);
  const Eigen::Index nodes = (*entries).size() / width;
  int holds =
      ((*entries).reshaped(width, nodes).topRows(block).array() <= 1e3 / k * (*held).reshaped(block, nodes).array())
          .all();
  MPI_Allreduce(MPI_IN_PLACE, &holds, 1, MPI_INT, MPI_LAND, PetscObjectComm(reinterpret_cast<PetscObject>(a)));
  return holds != 0;
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

// The parts with a contact law, or all contact parts.
template <int d>
std::vector<std::string> parts_in_contact(const Problem<d>& problem, bool mechanical) {
  std::vector<std::string> names;
  for (const ContactPart& contact : problem.contacts)
    if (contact.law || !mechanical) names.push_back(contact.part);
  return names;
}

// The nodes of parts, each value of which is prescribed.
template <int d>
RigidMotions::Resisted nodes_of(const Problem<d>& problem, const std::vector<std::string>& parts) {
  RigidMotions::Resisted out;
  for (const std::string& name : parts)
    for (const Index node : problem.mesh->part(name).nodes.reshaped()) {
      out.nodes.push_back(node);
      out.rows.push_back(Eigen::VectorXd::Ones(1));
    }
  return out;
}

// What supports resist, and springs.
template <int d>
RigidMotions::Resisted resisted(const Problem<d>& problem, bool on_springs) {
  const ResistedDirections<d> directions = resisted_directions(problem, on_springs);
  return {directions.nodes, {directions.rows.begin(), directions.rows.end()}};
}

// Whether all that supports and springs resist lies along the axes.
template <int d>
bool along_axes(const Problem<d>& problem) {
  const std::vector<Point<d>> rows = resisted_directions(problem, true).rows;
  return std::all_of(rows.begin(), rows.end(), [](const Point<d>& row) { return (row.array() != 0).count() <= 1; });
}

// Whether an entry of the diagonal of a part of an operator, times its factor, is to the whole's as `is` says.
template <class Is>
bool any_entry(Mat part, double factor, Mat whole, Is is) {
  if (!part) return false;
  const VecHandle own = diagonal_of(part), all = diagonal_of(whole);
  const Eigen::Index block = block_size(own), width = block_size(all);
  Values held(own), entries(all);
  const auto nodes = (*held).size() / block;
  int found = 0;
  for (Eigen::Index i = 0; i < nodes && !found; ++i)
    for (Eigen::Index c = 0; c < block; ++c) found |= is(factor * (*held)[i * block + c], (*entries)[i * width + c]);
  MPI_Allreduce(MPI_IN_PLACE, &found, 1, MPI_INT, MPI_LOR, PetscObjectComm(reinterpret_cast<PetscObject>(part)));
  return found != 0;
}

// Whether a part holds some node about as well as the body around it does, and whether it holds one far less.
bool holds_a_node(Mat part, double factor, Mat whole) {
  return any_entry(part, factor, whole, [](double own, double all) { return own > 0.3 * all; });
}

bool hardly_holds_one(Mat part, Mat whole) {
  return any_entry(part, 1, whole, [](double own, double all) { return own > 0 && own < 1e-3 * all; });
}

}  // namespace

template <int d>
StepSystems<d>::StepSystems(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                            const ContactSurface<d>& surface, double size, Coupling coupling, Backend backend,
                            ContactOptions contact_options)
    : k(size) {
  if (!(k > 0) || !std::isfinite(k)) throw std::invalid_argument("the time step must be positive and finite");
  const bool moves = problem.moves(), conducts = problem.conducts();
  // a capacity and an exchange that hold the constant temperature beside the conduction need no help
  if (conducts && largest_diagonal(operators.mass) / k + largest_diagonal(operators.exchange) <
                      0.1 * largest_diagonal(operators.conductivity))
    constants = RigidMotions(
        layout, 1, 1, nodes_of(problem, problem.prescribed_temperature), parts_in_contact(problem, false),
        at_nodes(problem, [](const Material<d>& m) { return m.conductivity ? m.conductivity->norm() : 0; }));
  const auto holds = [&](Vec x, Vec y) {  // the capacity and the exchange
    if (operators.exchange) WARMSLIP_PETSC(MatMult(operators.exchange, x, y));
    const VecHandle stored = duplicate(y);
    WARMSLIP_PETSC(MatMult(operators.mass, x, stored));
    WARMSLIP_PETSC(VecAXPY(y, 1 / k, stored));
  };
  if (coupling == Coupling::monolithic && moves && conducts) {
    if (!constants.empty()) constants.prepare(holds);
    if (problem.contact_heats())
      throw std::invalid_argument("heat that the contact makes or conducts needs the staggered or the lagged coupling");
    auto [scale, symmetry] = coupled_symmetry(problem);
    coupled_scale = scale;
    const MatHandle a = coupled_matrix(layout, problem, operators, k, scale);
    factor_motion(layout, problem, operators, surface, a, d + 1, symmetry, "coupled", backend);
  } else {
    if (moves) {
      const MatHandle a = momentum_matrix(layout, problem, operators, k);
      factor_motion(layout, problem, operators, surface, a, d, Symmetry::positive_definite, "momentum", backend);
    }
    if (conducts) {
      const MatHandle h = heat_matrix(operators, k);
      if (!constants.empty()) constants.add_springs(h);
      const auto apart = problem.contact_heats() ? surface.global_nodes() : std::vector<PetscInt>{};
      heat = factor(h, apart, problem.conducts_symmetrically() ? Symmetry::positive_definite : Symmetry::general, 1,
                    "heat", backend);
      if (!constants.empty()) constants.prepare(*heat, holds);
    }
  }
  if (surface.points() == 0) return;
  // forces are shared in many ways, see ContactSolver::shared and minimal_forces
  if (surface.shares()) contact_options.proximal = 1e-6;
  carried.resize(surface.points() * d, rigid.count());
  for (Eigen::Index j = 0; j < rigid.count(); ++j)
    carried.col(j) = surface.at_points(surface.nodal_values(rigid.motion(j)));
  RigidCoupling apart{Eigen::MatrixXd(surface.points() * d, 0), {}, {}};
  if (rigid.apart()) apart = {carried, {}, rigid.inertia()};
  apart.loads = apart.motions;
  for (Eigen::Index j = 0; j < apart.motions.cols(); ++j) {
    apart.motions.col(j) = surface.at_points(surface.nodal_values(rigid.along(j)));
    apart.loads.col(j) = surface.at_points(surface.nodal_values(rigid.along_transposed(j)));
  }
  contact =
      std::make_unique<ContactSolver<d>>(surface.at_points(momentum->compliance()), contact_options, std::move(apart));
}

// Factors the operator of the motion, of `width` unknowns a node, with the rigid motions solved for apart where the
// mass does not hold them.
template <int d>
void StepSystems<d>::factor_motion(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                                   const ContactSurface<d>& surface, Mat a, int width, Symmetry symmetry,
                                   const std::string& name, Backend backend) {
  bool partly = false;  // whether there are rigid motions that not even springs resist
  if (problem.has(&Material<d>::elasticity) || problem.has(&Material<d>::viscosity)) {
    const Eigen::VectorXd firmness = at_nodes(problem, [&](const Material<d>& m) {
      return (m.elasticity ? k * m.elasticity->norm() : 0) + (m.viscosity ? m.viscosity->norm() : 0);
    });
    const auto left_by = [&](bool springs) {
      return RigidMotions(layout, d, width, resisted(problem, springs), parts_in_contact(problem, true), firmness);
    };
    rigid = left_by(true);
    partly = !rigid.empty();
    // springs hold motions as a mass does; where they leave some to a mass or to contact, only if they are weak, and if
    // what they leave to a mass has no rounding of their forces, as that of springs along the axes has none
    const bool strong = holds_a_node(operators.springs, 1, operators.elasticity) ||
                        holds_a_node(operators.dashpots, 1, operators.viscosity);
    const bool weak = hardly_holds_one(operators.springs, operators.elasticity) ||
                      (problem.has(&Material<d>::viscosity) ? hardly_holds_one(operators.dashpots, operators.viscosity)
                                                            : bool(operators.dashpots));  // of no step's size
    if (!problem.springs.empty() && !(partly && (problem.inertial() ? !(weak && along_axes(problem)) : strong))) {
      rigid = left_by(false);
      sprung = !rigid.empty();
    }
  }
  if (partly && !problem.inertial() && surface.points() == 0)
    throw std::invalid_argument(
        "nothing holds the body: its supports leave it, or a part of it, a rigid motion, and it has no inertia and no "
        "contact; hold one more place or component, or give inertia.density > 0");
  const bool apart =
      !rigid.empty() && !mass_holds(operators.inertia, k, width, a) &&
      !(sprung && !partly && (holds_a_node(operators.springs, k, a) || holds_a_node(operators.dashpots, 1, a)));
  if (apart) rigid.add_springs(a);
  support_scales = warmslip::support_scales(layout, operators.inclined, a, width);
  momentum = factor(a, surface.unknowns(width), symmetry, width, name, backend);
  if (rigid.empty()) return;
  const auto mass = [&](Vec x, Vec y) {
    multiply(operators.inertia, x, y);
    WARMSLIP_PETSC(VecScale(y, 1 / k));
    if (sprung) add_springs(operators, k, x, y);
    release(layout, operators.prescribed_displacement, operators.inclined, y);  // a turn about a held node
  };
  if (!apart) {
    rigid.prepare(mass);
    return;
  }
  rigid.prepare(*momentum, mass);
  if (symmetry == Symmetry::definite_or_refused && !rigid.holds()) throw std::invalid_argument(indefinite_coupling);
}

template <int d>
void StepSystems<d>::add_springs(const Operators<d>& operators, double k, Vec x, Vec y) {
  const VecHandle force = duplicate(y);
  for (const auto& [part, size] : {std::pair{Mat(operators.springs), k}, std::pair{Mat(operators.dashpots), 1.0}}) {
    if (!part) continue;
    WARMSLIP_PETSC(MatMult(part, x, force));
    WARMSLIP_PETSC(VecAXPY(y, size, force));
  }
}

template <int d>
int StepSystems<d>::substitutions() const {
  return (momentum ? momentum->substitutions() : 0) + (heat ? heat->substitutions() : 0);
}

template <int d>
double StepSystems<d>::bytes() const {
  return (momentum ? momentum->bytes() : 0) + (heat ? heat->bytes() : 0);
}

template <int d>
double StepSystems<d>::flops() const {
  return (momentum ? momentum->flops() : 0) + (heat ? heat->flops() : 0);
}

template <int d>
std::shared_ptr<StepSystems<d>> SystemCache<d>::find(double k) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& one) { return one->k == k; });
  if (found == kept_.end()) return nullptr;
  std::rotate(found, found + 1, kept_.end());
  return kept_.back();
}

template <int d>
void SystemCache<d>::keep(std::shared_ptr<StepSystems<d>> systems) {
  kept_.push_back(std::move(systems));
  while (kept_.size() > 1 && layout_.sum(bytes()) > bound_) kept_.erase(kept_.begin());
}

template <int d>
void SystemCache<d>::clear_contact_caches() {
  for (const auto& systems : kept_)
    if (systems->contact) systems->contact->clear_cache();
}

template <int d>
double SystemCache<d>::bytes() const {
  double sum = 0;
  for (const auto& systems : kept_) sum += systems->bytes();
  return sum;
}

template struct StepSystems<2>;
template struct StepSystems<3>;
template class SystemCache<2>;
template class SystemCache<3>;

}  // namespace warmslip
