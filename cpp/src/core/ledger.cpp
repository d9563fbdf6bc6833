#include "warmslip/ledger.hpp"

#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "warmslip/contact_solver.hpp"

namespace warmslip {
namespace {

double dot(Vec a, Vec b) {
  PetscReal value;
  WARMSLIP_PETSC(VecDot(a, b, &value));
  return value;
}

// (a1 - a0) . (b1 - b0) without forming the differences
template <int d>
double dot_of_changes(const Layout<d>& layout, Vec a1, Vec a0, Vec b1, Vec b0) {
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
  PetscReal value;
  WARMSLIP_PETSC(VecNorm(v, NORM_INFINITY, &value));
  return value;
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
      viscous_w_(layout.vector(d)),
      conducted_(layout.vector(1)),
      exchanged_(layout.vector(1)),
      contact_force_(layout.vector(d)),
      elastic_rows_(row_sizes(operators.elasticity)),
      viscous_rows_(row_sizes(operators.viscosity)),
      conduction_rows_(row_sizes(operators.conductivity)),
      unknowns_(surface.unknowns(d)) {
  centroid_ = layout.mesh().nodes.colwise().mean().transpose();
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  for (PetscInt& i : unknowns_) i -= first * d;
  clamped_.resize(static_cast<std::size_t>(layout.owned()));
  cooled_.resize(clamped_.size());
  for (const PetscInt i : operators.clamped) clamped_[static_cast<std::size_t>(i / d - first)] = true;
  for (const PetscInt i : operators.cooled) cooled_[static_cast<std::size_t>(i - first)] = true;
}

template <int d>
Ledger Bookkeeper<d>::close(const Level& before, const Level& after, const StepInputs& in) {
  Ledger ledger{};
  WARMSLIP_PETSC(MatMult(operators_.viscosity, after.w, viscous_w_));
  WARMSLIP_PETSC(MatMult(operators_.conductivity, after.theta, conducted_));
  WARMSLIP_PETSC(MatMult(operators_.exchange, after.theta, exchanged_));
  contact(before, after, in, ledger);
  energy(before, after, in, ledger);
  resultants(before, after, in, heat(before, after, in, ledger), ledger);
  return ledger;
}

// The contact terms, from the law at u_n and not from the solver's forces.
template <int d>
void Bookkeeper<d>::contact(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const Eigen::VectorXd w_points = surface_.at_points(surface_.nodal_values(after.w));
  const auto& law = problem_.law;
  ContactProblem<d> problem{law, in.k, {}, in.contact_free, in.contact_scale};
  double stored_before = 0;
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), w = w_points.template segment<d>(i * d);
    const Point<d> u0 = before.contact_u.segment<d>(i * d), u1 = after.contact_u.segment<d>(i * d);
    const double weight = surface_.weights()[i];
    const double r1 = u1.dot(nu) - after.gap[i], r0 = u0.dot(nu) - after.gap[i], r_old = u0.dot(nu) - before.gap[i];
    l.contact += weight * law.compliance.energy(r1);
    stored_before += weight * law.compliance.energy(r_old);
    l.gap_work += weight * (law.compliance.energy(r0) - law.compliance.energy(r_old));
    l.contact_damping +=
        weight * (law.compliance.energy(r0) - law.compliance.energy(r1) - law.compliance.pressure(r1) * (r0 - r1));
    l.friction += in.k * weight * law.bound(r1) * (w - w.dot(nu) * nu).norm();
    problem.points.push_back({nu, weight, r0, u0, after.gap[i]});
  }
  l.contact_change = l.contact - stored_before;
  l.law_residual = law_residual(problem, in.contact_force, w_points, &l.law_floor);
}

// Momentum tested with k w_n.
template <int d>
void Bookkeeper<d>::energy(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double rho = problem_.material.density;
  const double kinetic_before = 0.5 * rho * dot(before.w, before.mass_w),
               elastic_before = 0.5 * dot(before.u, before.elastic_u);
  l.kinetic = 0.5 * rho * dot(after.w, after.mass_w);
  l.elastic = 0.5 * dot(after.u, after.elastic_u);
  l.kinetic_change = l.kinetic - kinetic_before;
  l.elastic_change = l.elastic - elastic_before;
  l.inertia_damping = 0.5 * rho * dot_of_changes(layout_, after.w, before.w, after.mass_w, before.mass_w);
  l.elastic_damping = 0.5 * dot_of_changes(layout_, after.u, before.u, after.elastic_u, before.elastic_u);
  l.viscous = in.k * dot(after.w, viscous_w_);
  l.load_work = in.k * dot(in.force, after.w);
  l.expansion_work = in.k * dot(in.expansion_theta, after.w);
  const double contact_before = l.contact - l.contact_change;
  const std::initializer_list<double> terms{l.kinetic,   kinetic_before,   l.elastic, elastic_before,
                                            l.contact,   contact_before,   l.viscous, l.friction,
                                            l.load_work, l.expansion_work, l.gap_work};
  // the law's pressure, with its rounding, enters four terms: stored before and after, damping, friction
  const double touching = std::max({l.contact, contact_before, l.contact_damping, l.friction, std::abs(l.gap_work)});
  l.energy_floor = touching > 0 ? 4 * l.law_floor * relative(touching, terms) : 0;
  l.energy_residual =
      relative(l.kinetic_change + l.elastic_change + l.contact_change + l.inertia_damping + l.elastic_damping +
                   l.contact_damping + l.viscous + l.friction - l.load_work - l.expansion_work - l.gap_work,
               terms);
}

// The heat balance tested with k theta_n; returns its relative residual.
template <int d>
double Bookkeeper<d>::heat(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double stored_before = 0.5 * dot(before.theta, before.mass_theta),
               stored = 0.5 * dot(after.theta, after.mass_theta);
  l.heat_change = stored - stored_before;
  l.heat_damping = 0.5 * dot_of_changes(layout_, after.theta, before.theta, after.mass_theta, before.mass_theta);
  l.conducted = in.k * dot(after.theta, conducted_);
  l.exchanged = in.k * dot(after.theta, exchanged_);
  l.supplied = in.k * dot(in.heat, after.theta);
  l.heating = in.k * dot(in.heating_w, after.theta);
  return relative(l.heat_change + l.heat_damping + l.conducted + l.exchanged - l.supplied - l.heating,
                  {stored, stored_before, l.heat_damping, l.conducted, l.exchanged, l.supplied, l.heating});
}

// Heat content (eta = 1), force and moment (v rigid), and both equations at every free node: the supports' reactions
// are the residuals of the fixed rows.
template <int d>
void Bookkeeper<d>::resultants(const Level& before, const Level& after, const StepInputs& in, double heat_energy,
                               Ledger& l) {
  const double rho = problem_.material.density, k = in.k;
  {
    const Eigen::VectorXd nodal = surface_.to_nodes(in.contact_force);
    Values out(contact_force_);
    for (std::size_t i = 0; i < unknowns_.size(); ++i)
      if (unknowns_[i] >= 0 && unknowns_[i] < layout_.owned() * d)
        (*out)[unknowns_[i]] = nodal[static_cast<Eigen::Index>(i)];
  }
  Resultant<d> force;
  double content = 0, content_size = 0, force_rounding = 0, moment_rounding = 0, heat_rounding = 0;
  // largest over the nodes: what an equation leaves over, the size of its terms, the forces in it and those applied
  enum { motion, motion_size, heat_left, heat_size, forces_here, applied, internal_size };
  std::array<double, 7> most{};
  const auto raise = [&](int which, double value) {
    most[static_cast<std::size_t>(which)] = std::max(most[static_cast<std::size_t>(which)], value);
  };
  const double u = largest(after.u), w = largest(after.w), theta = largest(after.theta);
  {
    Values m1(after.mass_w), m0(before.mass_w), f(in.force), e(after.elastic_u), b(viscous_w_), g(in.expansion_theta),
        c(contact_force_);
    Values t1(after.mass_theta), t0(before.mass_theta), q(in.heat), h(in.heating_w), flux(conducted_), x(exchanged_);
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const auto node = static_cast<std::size_t>(i);
      const Point<d> position = layout_.mesh().nodes.row(layout_.mesh_nodes()[node]).transpose() - centroid_;
      const auto at = [&](Values& v) -> Point<d> { return (*v).template segment<d>(i * d); };
      const Point<d> inertia = rho / k * (at(m1) - at(m0)), load = at(f), contact_here = at(c);
      force.add(position, inertia);
      force.add(position, -load);
      force.add(position, contact_here);
      const Point<d> internal = elastic_rows_.template segment<d>(i * d) * u +
                                viscous_rows_.template segment<d>(i * d) * w + at(g).cwiseAbs();
      force_rounding += internal.squaredNorm();
      moment_rounding += internal.squaredNorm() * position.squaredNorm();
      const Point<d> left = inertia - load + contact_here + at(b) + at(e) - at(g);
      if (clamped_[node])
        force.add(position, -left);
      else
        raise(motion, left.cwiseAbs().maxCoeff());
      const Point<d> given = load.cwiseAbs() + contact_here.cwiseAbs() + at(g).cwiseAbs();
      raise(motion_size, (rho / k * (at(m1).cwiseAbs() + at(m0).cwiseAbs()) + given + internal).maxCoeff());
      raise(applied, given.maxCoeff());
      raise(forces_here, (given + at(e).cwiseAbs() + at(b).cwiseAbs()).maxCoeff());
      raise(internal_size, internal.maxCoeff());
      const double storage = ((*t1)[i] - (*t0)[i]) / k, exchange = (*x)[i], source = (*q)[i] + (*h)[i];
      content += storage + exchange - source;
      content_size += std::abs(storage) + std::abs(exchange) + std::abs(source);
      const double within = conduction_rows_[i] * theta + (std::abs((*t1)[i]) + std::abs((*t0)[i])) / k;
      heat_rounding += within * within;
      const double wall = storage + exchange - source + (*flux)[i];
      if (cooled_[node]) {
        content -= wall;
        content_size += std::abs(wall);
      } else {
        raise(heat_left, std::abs(wall));
      }
      raise(heat_size, within + std::abs(exchange) + std::abs((*q)[i]) + std::abs((*h)[i]));
    }
  }
  const Eigen::VectorXd sums = layout_.sum(Eigen::VectorXd(force.sum)),
                        sizes = layout_.sum(Eigen::VectorXd(force.size));
  const double forces = sizes.head(d).maxCoeff(), moments = sizes.tail(sizes.size() - d).maxCoeff();
  force_rounding = layout_.sum(force_rounding);
  moment_rounding = layout_.sum(moment_rounding);
  for (Eigen::Index i = 0; i < sums.size(); ++i)
    l.force_residual = std::max(l.force_residual, i < d ? unexplained(sums[i], forces, force_rounding)
                                                        : unexplained(sums[i], moments, moment_rounding));
  const double heat = unexplained(layout_.sum(content), layout_.sum(content_size), layout_.sum(heat_rounding));
  // sums say nothing about the equations behind them: those of all free nodes hold as well, in size relative to the
  // largest
  MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(most.size()), MPI_DOUBLE, MPI_MAX, layout_.comm());
  l.force_residual = std::max(l.force_residual, relative(most[motion], {most[motion_size]}));
  l.heat_residual = std::max({heat_energy, heat, relative(most[heat_left], {most[heat_size]})});
  // without any load there is nothing a strain of rounding could be mistaken for
  if (most[applied] > 0)
    l.force_floor = std::numeric_limits<double>::epsilon() * relative(most[internal_size], {most[forces_here]});
}

template <int d>
void Bookkeeper<d>::momentum_defect(const Level& before, const Level& after, const StepInputs& in, Vec out) const {
  const double rate = problem_.material.density / in.k;
  WARMSLIP_PETSC(VecCopy(in.force, out));
  WARMSLIP_PETSC(VecAXPY(out, 1, in.expansion_theta));
  WARMSLIP_PETSC(VecAXPY(out, -1, viscous_w_));
  WARMSLIP_PETSC(VecAXPY(out, -1, after.elastic_u));
  WARMSLIP_PETSC(VecAXPY(out, -1, contact_force_));
  Values values(out), m1(after.mass_w), m0(before.mass_w);
  *values -= rate * (*m1 - *m0);
  for (PetscInt i = 0; i < layout_.owned(); ++i)
    if (clamped_[static_cast<std::size_t>(i)]) (*values).template segment<d>(i * d).setZero();
}

template <int d>
void Bookkeeper<d>::heat_defect(const Level& before, const Level& after, const StepInputs& in, Vec out) const {
  WARMSLIP_PETSC(VecCopy(in.heat, out));
  WARMSLIP_PETSC(VecAXPY(out, 1, in.heating_w));
  WARMSLIP_PETSC(VecAXPY(out, -1, conducted_));
  WARMSLIP_PETSC(VecAXPY(out, -1, exchanged_));
  Values values(out), m1(after.mass_theta), m0(before.mass_theta);
  *values -= (*m1 - *m0) / in.k;
  for (PetscInt i = 0; i < layout_.owned(); ++i)
    if (cooled_[static_cast<std::size_t>(i)]) (*values)[i] = 0;
}

template class Bookkeeper<2>;
template class Bookkeeper<3>;

}  // namespace warmslip
