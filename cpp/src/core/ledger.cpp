#include "warmslip/ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "warmslip/contact_solver.hpp"

namespace warmslip {
namespace {

double dot(Vec a, Vec b) {
  PetscReal value = 0;
  if (!a || !b) return 0;
  WARMSLIP_PETSC(VecDot(a, b, &value));
  return value;
}

// (a1 - a0) . (b1 - b0) without forming the differences
template <int d>
double dot_of_changes(const Layout<d>& layout, Vec a1, Vec a0, Vec b1, Vec b0) {
  if (!b1) return 0;
  Values x1(a1), x0(a0), y1(b1), y0(b0);
  return layout.sum(((*x1) - (*x0)).dot((*y1) - (*y0)));
}

double relative(double residual, std::initializer_list<double> terms) {
  double largest = 0;
  for (const double term : terms) largest = std::max(largest, std::abs(term));
  return largest > 0 ? std::abs(residual) / largest : 0;
}

// A sum over the nodes that should vanish, less what rounding explains, relative to the terms in it. What cancels
// within a row of an operator leaves its rounding, and the roundings of the rows add up like a random walk: `rounding`
// is the sum of their squares, in units of eps.
double unexplained(double sum, double terms, double rounding) {
  const double excess = std::abs(sum) - 16 * std::numeric_limits<double>::epsilon() * std::sqrt(rounding);
  return excess > 0 ? relative(excess, {terms}) : std::isnan(sum) ? sum : 0;
}

// Sum of |entries| of every row that this rank owns.
Eigen::VectorXd row_sizes(Mat a) {
  if (!a) return {};
  PetscInt begin, end;
  WARMSLIP_PETSC(MatGetOwnershipRange(a, &begin, &end));
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(end - begin);
  for (PetscInt row = begin; row < end; ++row) {
    PetscInt count;
    const PetscScalar* entries;
    WARMSLIP_PETSC(MatGetRow(a, row, &count, nullptr, &entries));
    for (PetscInt e = 0; e < count; ++e) sizes[row - begin] += std::abs(entries[e]);
    WARMSLIP_PETSC(MatRestoreRow(a, row, &count, nullptr, &entries));
  }
  return sizes;
}

double largest(Vec v) {
  PetscReal value = 0;
  if (v) WARMSLIP_PETSC(VecNorm(v, NORM_INFINITY, &value));
  return value;
}

// out += factor * v, if there is such a vector
void add(Vec out, double factor, Vec v) {
  if (v) WARMSLIP_PETSC(VecAXPY(out, factor, v));
}

// Largest of some sizes over all nodes of all ranks.
template <std::size_t count>
std::array<double, count> over_ranks(MPI_Comm comm, std::array<double, count> most) {
  MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(count), MPI_DOUBLE, MPI_MAX, comm);
  return most;
}

// Sums of nodal forces and of their moments, and of their sizes.
template <int d>
struct Resultant {
  static constexpr int moments = d == 2 ? 1 : 3;
  Eigen::Matrix<double, d + moments, 1> sum = Eigen::Matrix<double, d + moments, 1>::Zero();
  Eigen::Matrix<double, d + moments, 1> size = Eigen::Matrix<double, d + moments, 1>::Zero();
  void add(const Point<d>& x, const Point<d>& f) {
    Eigen::Matrix<double, d + moments, 1> term;
    term.template head<d>() = f;
    if constexpr (d == 2)
      term[2] = x[0] * f[1] - x[1] * f[0];
    else
      term.template tail<3>() = x.cross(f);
    sum += term;
    size += term.cwiseAbs();
  }
};

}  // namespace

template <int d>
Bookkeeper<d>::Bookkeeper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                          const ContactSurface<d>& surface)
    : layout_(layout),
      problem_(problem),
      operators_(operators),
      surface_(surface),
      elastic_rows_(row_sizes(operators.elasticity)),
      viscous_rows_(row_sizes(operators.viscosity)),
      conduction_rows_(row_sizes(operators.conductivity)),
      unknowns_(surface.unknowns(d)),
      nodes_(surface.global_nodes()) {
  if (operators.viscosity) viscous_w_ = layout.vector(d);
  if (surface.points() > 0) contact_force_ = layout.vector(d);
  if (operators.conductivity) conducted_ = layout.vector(1);
  if (operators.exchange) exchanged_ = layout.vector(1);
  if (operators.conductivity && problem.contact_heats()) contact_heat_ = layout.vector(1);
  centroid_ = layout.mesh().nodes.colwise().mean().transpose();
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  for (PetscInt& i : unknowns_) i -= first * d;
  for (PetscInt& i : nodes_) i -= first;
  clamped_.resize(static_cast<std::size_t>(layout.owned()));
  cooled_.resize(clamped_.size());
  for (const PetscInt i : operators.clamped) clamped_[static_cast<std::size_t>(i / d - first)] = true;
  for (const PetscInt i : operators.cooled) cooled_[static_cast<std::size_t>(i - first)] = true;
}

// Replicated nodal values into the entries `at`, relative to this rank's range, of a distributed vector.
template <int d>
void Bookkeeper<d>::place(const std::vector<PetscInt>& at, const Eigen::VectorXd& nodal, Vec out) const {
  Values values(out);
  for (std::size_t i = 0; i < at.size(); ++i)
    if (at[i] >= 0 && at[i] < (*values).size()) (*values)[at[i]] = nodal[static_cast<Eigen::Index>(i)];
}

template <int d>
Ledger Bookkeeper<d>::close(const Level& before, const Level& after, const StepInputs& in) {
  Ledger ledger{};
  multiply(operators_.viscosity, after.w, viscous_w_);
  multiply(operators_.conductivity, after.theta, conducted_);
  multiply(operators_.exchange, after.theta, exchanged_);
  if (surface_.points() > 0) contact(before, after, in, ledger);
  if (after.w) {
    forces(before, after, in, ledger);
    energy(before, after, in, ledger);
  }
  if (after.theta) heat(before, after, in, ledger);
  return ledger;
}

// The contact terms, from the law at u_n and not from the solver's forces.
template <int d>
void Bookkeeper<d>::contact(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const Eigen::VectorXd w_points = surface_.at_points(surface_.nodal_values(after.w));
  const ContactProblem<d> problem =
      contact_problem(problem_, surface_, in.k, before.contact_u, after.gap, in.contact_free, in.contact_scale);
  double stored_before = 0;
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), w = w_points.template segment<d>(i * d);
    const Point<d> u0 = before.contact_u.segment<d>(i * d), u1 = after.contact_u.segment<d>(i * d);
    const double weight = surface_.weights()[i];
    const double r1 = u1.dot(nu) - after.gap[i], r0 = u0.dot(nu) - after.gap[i], r_old = u0.dot(nu) - before.gap[i];
    const ContactLaw& law = problem.law(static_cast<std::size_t>(i));
    l.contact += weight * law.compliance.energy(r1);
    stored_before += weight * law.compliance.energy(r_old);
    l.gap_work += weight * (law.compliance.energy(r0) - law.compliance.energy(r_old));
    l.contact_damping +=
        weight * (law.compliance.energy(r0) - law.compliance.energy(r1) - law.compliance.pressure(r1) * (r0 - r1));
    const double speed = (w - w.dot(nu) * nu).norm();
    l.friction += in.k * friction_power(law.friction, weight * law.bound(r1, speed).value, speed);
  }
  l.contact_change = l.contact - stored_before;
  l.law_residual = law_residual(problem, in.contact_force, w_points, &l.law_floor);
  place(unknowns_, surface_.to_nodes(in.contact_force), contact_force_);
  if (!contact_heat_) return;
  const ContactFlow flow = contact_flow(problem_, surface_, after.contact_u, w_points, after.gap);
  const Eigen::VectorXd led = flow.conductance.cwiseProduct(after.contact_theta - in.foundation);
  l.exchanged = in.k * led.dot(after.contact_theta);
  l.friction_heating = in.k * flow.friction.dot(after.contact_theta);
  place(nodes_, surface_.scalar_shape().transpose() * (led - flow.friction), contact_heat_);
}

// Momentum tested with k w_n.
template <int d>
void Bookkeeper<d>::energy(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double kinetic_before = 0.5 * dot(before.w, before.momentum),
               elastic_before = 0.5 * dot(before.u, before.elastic_u);
  l.kinetic = 0.5 * dot(after.w, after.momentum);
  l.elastic = 0.5 * dot(after.u, after.elastic_u);
  l.kinetic_change = l.kinetic - kinetic_before;
  l.elastic_change = l.elastic - elastic_before;
  l.inertia_damping = 0.5 * dot_of_changes(layout_, after.w, before.w, after.momentum, before.momentum);
  l.elastic_damping = 0.5 * dot_of_changes(layout_, after.u, before.u, after.elastic_u, before.elastic_u);
  l.viscous = in.k * dot(after.w, viscous_w_);
  l.load_work = in.k * dot(in.force, after.w);
  l.expansion_work = in.k * dot(in.expansion_theta, after.w);
  const double contact_before = l.contact - l.contact_change;
  const std::initializer_list<double> terms{
      l.kinetic,  kinetic_before, l.elastic,        elastic_before, l.contact,      contact_before, l.viscous,
      l.friction, l.load_work,    l.expansion_work, l.gap_work,     l.support_work, work_size_};
  // the law's pressure, with its rounding, enters four terms: stored before and after, damping, friction
  const double touching = std::max({l.contact, contact_before, l.contact_damping, l.friction, std::abs(l.gap_work)});
  l.energy_floor = touching > 0 ? 4 * l.law_floor * relative(touching, terms) : 0;
  const double sum = l.kinetic_change + l.elastic_change + l.contact_change + l.inertia_damping + l.elastic_damping +
                     l.contact_damping + l.viscous + l.friction - l.load_work - l.expansion_work - l.gap_work -
                     l.support_work;
  l.energy_residual = relative(sum, terms);
  // what rounding hides of the forces it hides of their work; where there are none, the work is all rounding
  if (acted_on_)
    l.energy_floor += 16 * l.force_floor;
  else
    l.energy_residual = unexplained(sum, *std::max_element(terms.begin(), terms.end()), work_rounding_);
}

// Force and moment (v rigid), and the equation of motion at every free node: the supports' reactions are the residuals
// of the fixed rows.
template <int d>
void Bookkeeper<d>::forces(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  Resultant<d> force;
  double force_rounding = 0, moment_rounding = 0, work_rounding = 0, work_size = 0;
  // largest over the nodes: what the equation leaves over, the size of its terms, the forces in it and those applied
  enum { motion, motion_size, forces_here, applied, internal_size };
  std::array<double, 5> most{};
  const auto raise = [&](std::size_t which, double value) { most[which] = std::max(most[which], value); };
  const double u = largest(after.u), w = largest(after.w);
  {
    Values m1(after.momentum), m0(before.momentum), f(in.force), e(after.elastic_u), b(viscous_w_),
        g(in.expansion_theta), c(contact_force_), velocity(after.w), displacement(after.u);
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const Point<d> position =
          layout_.mesh().nodes.row(layout_.mesh_nodes()[static_cast<std::size_t>(i)]).transpose() - centroid_;
      const auto at = [&](auto&& v) -> Point<d> {
        return v.size() ? Point<d>(v.template segment<d>(i * d)) : Point<d>(Point<d>::Zero());
      };
      const Point<d> p1 = at(*m1), p0 = at(*m0), inertia = (p1 - p0) / in.k, load = at(*f), contact_here = at(*c),
                     elastic = at(*e), viscous = at(*b), expansion = at(*g);
      force.add(position, inertia);
      force.add(position, -load);
      force.add(position, contact_here);
      const Point<d> internal = at(elastic_rows_) * u + at(viscous_rows_) * w + expansion.cwiseAbs();
      force_rounding += internal.squaredNorm();
      work_size += in.k * load.norm() * at(*velocity).norm();
      const Point<d> way = at(*displacement).cwiseAbs() + in.k * at(*velocity).cwiseAbs();
      work_rounding += std::pow(way.dot(internal), 2);
      moment_rounding += internal.squaredNorm() * position.squaredNorm();
      const Point<d> left = inertia - load + contact_here + viscous + elastic - expansion;
      if (clamped_[static_cast<std::size_t>(i)]) {
        force.add(position, -left);
        l.support_work += in.k * left.dot(at(*velocity));
        work_size += in.k * left.norm() * at(*velocity).norm();
      } else {
        raise(motion, left.cwiseAbs().maxCoeff());
      }
      const Point<d> given = load.cwiseAbs() + contact_here.cwiseAbs() + expansion.cwiseAbs();
      raise(motion_size, ((p1.cwiseAbs() + p0.cwiseAbs()) / in.k + given + internal).maxCoeff());
      raise(applied, given.maxCoeff());
      raise(forces_here, (given + elastic.cwiseAbs() + viscous.cwiseAbs()).maxCoeff());
      raise(internal_size, internal.maxCoeff());
    }
  }
  const Eigen::VectorXd sums = layout_.sum(Eigen::VectorXd(force.sum)),
                        sizes = layout_.sum(Eigen::VectorXd(force.size));
  const double forces = sizes.head(d).maxCoeff(), moments = sizes.tail(sizes.size() - d).maxCoeff();
  force_rounding = layout_.sum(force_rounding);
  moment_rounding = layout_.sum(moment_rounding);
  work_rounding_ = layout_.sum(work_rounding);
  work_size_ = layout_.sum(work_size);
  l.support_work = layout_.sum(l.support_work);
  for (Eigen::Index i = 0; i < sums.size(); ++i)
    l.force_residual = std::max(l.force_residual, i < d ? unexplained(sums[i], forces, force_rounding)
                                                        : unexplained(sums[i], moments, moment_rounding));
  // sums say nothing about the equations behind them: those of all free nodes hold as well, in size relative to the
  // largest
  most = over_ranks(layout_.comm(), most);
  l.force_residual = std::max(l.force_residual, relative(most[motion], {most[motion_size]}));
  // without any load there is nothing a strain of rounding could be mistaken for
  acted_on_ = most[applied] > 0;
  if (acted_on_)
    l.force_floor = std::numeric_limits<double>::epsilon() * relative(most[internal_size], {most[forces_here]});
}

// The heat balance tested with k theta_n and with 1, and its equation at every free node.
template <int d>
void Bookkeeper<d>::heat(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double stored_before = 0.5 * dot(before.theta, before.mass_theta),
               stored = 0.5 * dot(after.theta, after.mass_theta);
  double content = 0, content_size = 0, rounding = 0;
  enum { left_over, size };
  std::array<double, 2> most{};
  const double theta = largest(after.theta);
  {
    Values t1(after.mass_theta), t0(before.mass_theta), q(in.heat), h(in.heating_w), flux(conducted_), x(exchanged_),
        c(contact_heat_), values(after.theta);
    const auto at = [](auto&& v, PetscInt i) { return v.size() ? v[i] : 0.0; };
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const double storage = ((*t1)[i] - (*t0)[i]) / in.k, supply = at(*q, i), heating = at(*h, i);
      const double exchange = at(*x, i) + at(*c, i), source = supply + heating;
      content += storage + exchange - source;
      content_size += std::abs(storage) + std::abs(exchange) + std::abs(source);
      const double within = conduction_rows_[i] * theta + (std::abs((*t1)[i]) + std::abs((*t0)[i])) / in.k;
      rounding += within * within;
      const double wall = storage + exchange - source + (*flux)[i];
      if (cooled_[static_cast<std::size_t>(i)]) {
        content -= wall;
        content_size += std::abs(wall);
        l.held += in.k * wall * (*values)[i];
      } else {
        most[left_over] = std::max(most[left_over], std::abs(wall));
      }
      most[size] = std::max(most[size], within + std::abs(exchange) + std::abs(supply) + std::abs(heating));
    }
  }
  l.held = layout_.sum(l.held);
  l.heat_change = stored - stored_before;
  l.heat_damping = 0.5 * dot_of_changes(layout_, after.theta, before.theta, after.mass_theta, before.mass_theta);
  l.conducted = in.k * dot(after.theta, conducted_);
  l.exchanged += in.k * dot(after.theta, exchanged_);
  l.supplied = in.k * dot(in.heat, after.theta);
  l.heating = in.k * dot(in.heating_w, after.theta);
  l.heat_residual = relative(
      l.heat_change + l.heat_damping + l.conducted + l.exchanged - l.supplied - l.heating - l.friction_heating - l.held,
      {stored, stored_before, l.heat_damping, l.conducted, l.exchanged, l.supplied, l.heating, l.friction_heating,
       l.held});
  most = over_ranks(layout_.comm(), most);
  l.heat_residual =
      std::max({l.heat_residual, unexplained(layout_.sum(content), layout_.sum(content_size), layout_.sum(rounding)),
                relative(most[left_over], {most[size]})});
}

template <int d>
void Bookkeeper<d>::momentum_defect(const Level& before, const Level& after, const StepInputs& in, Vec out) const {
  WARMSLIP_PETSC(VecCopy(in.force, out));
  add(out, 1, in.expansion_theta);
  add(out, -1, viscous_w_);
  add(out, -1, after.elastic_u);
  add(out, -1, contact_force_);
  Values values(out), m1(after.momentum), m0(before.momentum);
  if (after.momentum) *values -= (*m1 - *m0) / in.k;
  for (PetscInt i = 0; i < layout_.owned(); ++i)
    if (clamped_[static_cast<std::size_t>(i)]) (*values).template segment<d>(i * d).setZero();
}

template <int d>
void Bookkeeper<d>::heat_defect(const Level& before, const Level& after, const StepInputs& in, Vec out) const {
  WARMSLIP_PETSC(VecCopy(in.heat, out));
  add(out, 1, in.heating_w);
  add(out, -1, conducted_);
  add(out, -1, exchanged_);
  add(out, -1, contact_heat_);
  Values values(out), m1(after.mass_theta), m0(before.mass_theta);
  *values -= (*m1 - *m0) / in.k;
  for (PetscInt i = 0; i < layout_.owned(); ++i)
    if (cooled_[static_cast<std::size_t>(i)]) (*values)[i] = 0;
}

template class Bookkeeper<2>;
template class Bookkeeper<3>;

}  // namespace warmslip
