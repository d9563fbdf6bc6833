#include "warmslip/ledger.hpp"

#include <cmath>
#include <initializer_list>

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

// Sums of nodal forces, and of their moments about the origin: columns of `terms`, then the scale.
template <int d>
struct Resultant {
  static constexpr int moments = d == 2 ? 1 : 3;
  Eigen::Matrix<double, d + moments, 1> sum = Eigen::Matrix<double, d + moments, 1>::Zero();
  Eigen::Matrix<double, d + moments, 1> size = Eigen::Matrix<double, d + moments, 1>::Zero();
  void add(const Point<d>& x, const Point<d>& f) {
    Eigen::Matrix<double, d + moments, 1> term;
    term.template head<d>() = f;
    if constexpr (d == 2) term[2] = x[0] * f[1] - x[1] * f[0];
    else term.template tail<3>() = x.cross(f);
    sum += term;
    size += term.cwiseAbs();
  }
};

}  // namespace

template <int d>
Ledger close(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
             const ContactSurface<d>& surface, const Level& before, const Level& after, const StepInputs& in) {
  const double rho = problem.material.density, k = in.k;
  Ledger l{};
  const VecHandle viscous_w = duplicate(after.w), conducted = duplicate(after.theta), exchanged = duplicate(after.theta);
  WARMSLIP_PETSC(MatMult(operators.viscosity, after.w, viscous_w));
  WARMSLIP_PETSC(MatMult(operators.conductivity, after.theta, conducted));
  WARMSLIP_PETSC(MatMult(operators.exchange, after.theta, exchanged));

  // energy, tested with k w_n
  const double kinetic_before = 0.5 * rho * dot(before.w, before.mass_w), elastic_before = 0.5 * dot(before.u, before.elastic_u);
  l.kinetic = 0.5 * rho * dot(after.w, after.mass_w);
  l.elastic = 0.5 * dot(after.u, after.elastic_u);
  l.kinetic_change = l.kinetic - kinetic_before;
  l.elastic_change = l.elastic - elastic_before;
  l.inertia_damping = 0.5 * rho * dot_of_changes(layout, after.w, before.w, after.mass_w, before.mass_w);
  l.elastic_damping = 0.5 * dot_of_changes(layout, after.u, before.u, after.elastic_u, before.elastic_u);
  l.viscous = k * dot(after.w, viscous_w);
  l.load_work = k * dot(in.force, after.w);
  l.expansion_work = k * dot(in.expansion_theta, after.w);

  // the contact terms, from the law at u_n and not from the solver's forces
  const Eigen::VectorXd w_points = surface.at_points(surface.nodal_values(after.w));
  const auto& law = problem.law;
  ContactProblem<d> contact{law, k, {}, in.contact_free};
  double contact_before = 0;
  for (Eigen::Index i = 0; i < surface.points(); ++i) {
    const Point<d> nu = surface.normals().row(i).transpose(), w = w_points.template segment<d>(i * d);
    const Point<d> u0 = before.contact_u.segment<d>(i * d), u1 = after.contact_u.segment<d>(i * d);
    const double weight = surface.weights()[i];
    const double r1 = u1.dot(nu) - after.gap[i], r0 = u0.dot(nu) - after.gap[i], r_old = u0.dot(nu) - before.gap[i];
    l.contact += weight * law.compliance.energy(r1);
    contact_before += weight * law.compliance.energy(r_old);
    l.gap_work += weight * (law.compliance.energy(r0) - law.compliance.energy(r_old));
    l.contact_damping += weight * (law.compliance.energy(r0) - law.compliance.energy(r1) - law.compliance.pressure(r1) * (r0 - r1));
    l.friction += k * weight * law.bound(r1) * (w - w.dot(nu) * nu).norm();
    contact.points.push_back({nu, weight, r0, u0, after.gap[i]});
  }
  l.contact_change = l.contact - contact_before;
  l.energy_residual = relative(l.kinetic_change + l.elastic_change + l.contact_change + l.inertia_damping + l.elastic_damping +
                                   l.contact_damping + l.viscous + l.friction - l.load_work - l.expansion_work - l.gap_work,
                               {l.kinetic, kinetic_before, l.elastic, elastic_before, l.contact, contact_before, l.viscous,
                                l.friction, l.load_work, l.expansion_work, l.gap_work});
  l.law_residual = law_residual(contact, in.contact_force, w_points, &l.law_floor);

  // heat, tested with k theta_n
  const double heat_before = 0.5 * dot(before.theta, before.mass_theta), heat = 0.5 * dot(after.theta, after.mass_theta);
  l.heat_change = heat - heat_before;
  l.heat_damping = 0.5 * dot_of_changes(layout, after.theta, before.theta, after.mass_theta, before.mass_theta);
  l.conducted = k * dot(after.theta, conducted);
  l.exchanged = k * dot(after.theta, exchanged);
  l.supplied = k * dot(in.heat, after.theta);
  l.heating = k * dot(in.heating_w, after.theta);
  const double heat_energy = relative(l.heat_change + l.heat_damping + l.conducted + l.exchanged - l.supplied - l.heating,
                                      {heat, heat_before, l.heat_damping, l.conducted, l.exchanged, l.supplied, l.heating});

  // heat content (eta = 1), force and moment (v rigid): the supports' reactions are the residuals of the fixed rows
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  std::vector<bool> cooled(static_cast<std::size_t>(layout.owned())), clamped(cooled.size());
  for (const PetscInt i : operators.cooled) cooled[static_cast<std::size_t>(i - first)] = true;
  for (const PetscInt i : operators.clamped) clamped[static_cast<std::size_t>(i / d - first)] = true;
  const VecHandle contact_force = duplicate(after.w);
  {
    const Eigen::VectorXd nodal = surface.to_nodes(in.contact_force);
    const auto unknowns = surface.unknowns(d);
    Values out(contact_force);
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      const PetscInt row = unknowns[i] - first * d;
      if (row >= 0 && row < layout.owned() * d) (*out)[row] = nodal[static_cast<Eigen::Index>(i)];
    }
  }
  Resultant<d> force;
  double content = 0, content_size = 0;
  {
    Values m1(after.mass_w), m0(before.mass_w), f(in.force), e(after.elastic_u), b(viscous_w), g(in.expansion_theta), c(contact_force);
    Values t1(after.mass_theta), t0(before.mass_theta), q(in.heat), h(in.heating_w), flux(conducted), x(exchanged);
    for (PetscInt i = 0; i < layout.owned(); ++i) {
      const Point<d> position = layout.mesh().nodes.row(layout.mesh_nodes()[static_cast<std::size_t>(i)]).transpose();
      const auto at = [&](Values& v) -> Point<d> { return (*v).template segment<d>(i * d); };
      const Point<d> inertia = rho / k * (at(m1) - at(m0)), load = at(f), contact_here = at(c);
      force.add(position, inertia);
      force.add(position, -load);
      force.add(position, contact_here);
      if (clamped[static_cast<std::size_t>(i)]) force.add(position, -(inertia - load + contact_here + at(b) + at(e) - at(g)));
      const double storage = ((*t1)[i] - (*t0)[i]) / k, exchange = (*x)[i], source = (*q)[i] + (*h)[i];
      content += storage + exchange - source;
      content_size += std::abs(storage) + std::abs(exchange) + std::abs(source);
      if (cooled[static_cast<std::size_t>(i)]) {
        const double wall = storage + exchange - source + (*flux)[i];
        content -= wall;
        content_size += std::abs(wall);
      }
    }
  }
  const Eigen::VectorXd sums = layout.sum(Eigen::VectorXd(force.sum)), sizes = layout.sum(Eigen::VectorXd(force.size));
  for (Eigen::Index i = 0; i < sums.size(); ++i)
    l.force_residual = std::max(l.force_residual, relative(sums[i], {sizes.maxCoeff()}));
  l.heat_residual = std::max(heat_energy, relative(layout.sum(content), {layout.sum(content_size)}));
  return l;
}

template Ledger close<2>(const Layout<2>&, const Problem<2>&, const Operators<2>&, const ContactSurface<2>&, const Level&, const Level&, const StepInputs&);
template Ledger close<3>(const Layout<3>&, const Problem<3>&, const Operators<3>&, const ContactSurface<3>&, const Level&, const Level&, const StepInputs&);

}  // namespace warmslip
