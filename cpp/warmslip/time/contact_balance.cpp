// The terms of the contact in the balances, with their own interpolation to the contact points.
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "warmslip/contact/residual.hpp"
#include "warmslip/mesh/quadrature.hpp"
#include "warmslip/time/balances.hpp"

namespace warmslip {

// The hat functions of the contact nodes at the contact points, from where the points are: the facet of the point's
// part with its normal that it lies on, and its barycentric coordinates there. Nothing of the solver's own matrix is
// used, so that a fault in it shows. Far from the origin positions are rounded, and the nearest point of the rule is
// meant. Points come in the order of the facets, hence the search goes on from the last one.
template <int d>
void BalanceEvaluator<d>::find_shape_functions() {
  const Mesh<d>& mesh = layout_.mesh();
  std::map<Index, int> column;
  for (const Index node : surface_.mesh_nodes()) column.emplace(node, static_cast<int>(column.size()));
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index facet = 0;
  std::map<int, Rule> rules;
  for (const ContactPart& contact : problem_.contacts)
    if (const int points = contact.quadrature.points; points > 0) rules.emplace(points, simplex_rule(d - 1, points));
  for (Eigen::Index q = 0; q < surface_.points(); ++q) {
    const ContactPart& contact = problem_.contacts[surface_.contact(q)];
    const Facets<d>& facets = mesh.part(contact.part);
    const Point<d> x = surface_.positions().row(q).transpose(), nu = surface_.normals().row(q).transpose();
    bool found = false;
    for (Eigen::Index tried = 0; tried < facets.nodes.rows() && !found; ++tried, ++facet) {
      facet %= facets.nodes.rows();
      const Point<d> area = area_normal(mesh, facets, facet);
      if ((area.normalized() - nu).norm() > 1e-9) continue;
      Tensor2<d> corners;
      for (int i = 0; i < d; ++i) corners.col(i) = mesh.nodes.row(facets.nodes(facet, i)).transpose();
      // x = sum of b_i corner_i with sum b_i = 1, in the facet's plane
      Eigen::Matrix<double, d, d - 1> sides;
      for (int i = 1; i < d; ++i) sides.col(i - 1) = corners.col(i) - corners.col(0);
      const Eigen::Matrix<double, d - 1, 1> b = sides.colPivHouseholderQr().solve(x - corners.col(0));
      const double off = 1e-9 + 8 * std::numeric_limits<double>::epsilon() * corners.cwiseAbs().maxCoeff() /
                                    sides.colwise().norm().minCoeff();
      if (b.minCoeff() < -off || b.sum() > 1 + off || (sides * b - (x - corners.col(0))).norm() > off * sides.norm())
        continue;
      found = true;
      Point<d> weights(Point<d>::Constant(1 - b.sum()));
      weights.template tail<d - 1>() = b;
      if (contact.quadrature.points > 0) {
        const auto& points = rules.at(contact.quadrature.points).barycentric;
        Eigen::Index nearest;
        if ((points.rowwise() - weights.transpose()).rowwise().norm().minCoeff(&nearest) <= 4 * off)
          weights = points.row(nearest).transpose();
      }
      if (weights.maxCoeff() > 1 - 1e-9) {  // at a corner: rounding of the others would carry large forces to them
        Eigen::Index corner;
        weights.maxCoeff(&corner);
        weights = Point<d>::Unit(corner);
      }
      for (int i = 0; i < d; ++i)
        if (weights[i] != 0) entries.emplace_back(static_cast<int>(q), column.at(facets.nodes(facet, i)), weights[i]);
      --facet;
    }
    if (!found) throw std::logic_error("a contact point lies on no facet of its part");
  }
  shape_.resize(surface_.points(), surface_.nodes());
  shape_.setFromTriplets(entries.begin(), entries.end());
}

// Values at the contact points, (block points), with the interpolation of the balances.
template <int d>
Eigen::VectorXd BalanceEvaluator<d>::at_points(Vec v) const {
  const Eigen::Index block = block_size(v);
  const Eigen::VectorXd nodal = surface_.nodal_values(v);
  const RealTable<Eigen::Dynamic> table =
      shape_ * Eigen::Map<const RealTable<Eigen::Dynamic>>(nodal.data(), surface_.nodes(), block);
  return Eigen::Map<const Eigen::VectorXd>(table.data(), table.size());
}

// Replicated nodal values into the entries `at`, relative to this rank's range, of a distributed vector.
template <int d>
void BalanceEvaluator<d>::place(const std::vector<PetscInt>& at, const Eigen::VectorXd& nodal, Vec out) const {
  Values values(out);
  for (std::size_t i = 0; i < at.size(); ++i)
    if (at[i] >= 0 && at[i] < (*values).size()) (*values)[at[i]] = nodal[static_cast<Eigen::Index>(i)];
}

// The contact terms: stored energy and friction from the forces, as a stiff law leaves no digits to its penetrations;
// that forces and penetrations obey the law is a balance of its own.
template <int d>
void BalanceEvaluator<d>::contact(const TimeLevel& before, const TimeLevel& after, const StepInputs& in, Balances& l) {
  const Eigen::VectorXd w_points = at_points(after.w) - in.drive, u1_points = at_points(after.u),
                        u0_points = at_points(before.u);
  const ContactProblem<d> problem = contact_problem(problem_, surface_, in.k, u0_points, after.gap, in.contact_free);
  double stored_before = 0;
  // an open point that cohesion holds has a normal force of rounding, which is none
  const auto normal_force = [&](const Eigen::VectorXd& forces, Eigen::Index i, double penetration) {
    const double normal = forces.segment<d>(i * d).dot(surface_.normals().row(i).transpose());
    return penetration < 0 && std::abs(normal) <= 1e-12 * forces.lpNorm<Eigen::Infinity>() ? 0 : normal;
  };
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const Point<d> nu = surface_.normals().row(i).transpose(), w = w_points.template segment<d>(i * d);
    const Point<d> u0 = u0_points.segment<d>(i * d), u1 = u1_points.segment<d>(i * d);
    const double weight = surface_.weights()[i], lambda = normal_force(in.contact_force, i, u1.dot(nu) - after.gap[i]),
                 lambda_old = normal_force(before.contact_force, i, u0.dot(nu) - before.gap[i]);
    const ContactLaw& law = problem.law(static_cast<std::size_t>(i));
    const NormalCompliance& p = law.compliance;
    const double r1 = p.penetration(lambda / weight, u1.dot(nu) - after.gap[i]),
                 r_old = p.penetration(lambda_old / weight, u0.dot(nu) - before.gap[i]),
                 r0 = r_old + before.gap[i] - after.gap[i];
    l.contact += weight * p.energy(r1);
    if (p.rigid()) {  // it stores nothing: a foundation that moves in does work, a body that comes to rest loses it
      l.gap_work += lambda * std::max(r0, 0.0);
      l.contact_damping += lambda * std::max(-r0, 0.0);
    } else {
      stored_before += weight * p.energy(r_old);
      l.gap_work += weight * (p.energy(r0) - p.energy(r_old));
      l.contact_damping += weight * (p.energy(r0) - p.energy(r1)) - lambda * (r0 - r1);
    }
    const double speed = (w - w.dot(nu) * nu).norm(), pressure = std::max(lambda, 0.0) / weight;
    const double bound = weight * law.friction.bound(pressure, speed).value;
    l.friction += in.k * friction_power(law.friction, bound, speed);
    const Point<d> drive = in.drive.template segment<d>(i * d), force = in.contact_force.template segment<d>(i * d);
    l.foundation_work -= in.k * force.dot(drive);
    work_magnitude_ += in.k * force.cwiseAbs().dot(drive.cwiseAbs());
    // of the work of the force on all that its penetration is made of
    const auto along = [&](const Point<d>& v) { return v.cwiseAbs().dot(nu.cwiseAbs()); };
    work_magnitude_ += std::abs(lambda) * (along(u1) + along(u0) + std::abs(after.gap[i]) + std::abs(before.gap[i]));
    // and of that along the velocity, which is what the contact leaves of the free one
    work_magnitude_ += std::max(in.contact_force.template segment<d>(i * d).norm(), bound) * in.k *
                       (w.norm() + in.contact_free.template segment<d>(i * d).norm());
    work_magnitude_ += bound * in.least_motion.norm();
  }
  l.contact_change = l.contact - stored_before;
  l.law_residual = law_residual<d>(problem, in.contact_force, w_points, in.least_motion.template head<d>());
  Eigen::VectorXd nodal(surface_.nodes() * d);
  Eigen::Map<RealTable<d>>(nodal.data(), surface_.nodes(), d) =
      shape_.transpose() * Eigen::Map<const RealTable<d>>(in.contact_force.data(), surface_.points(), d);
  place(unknowns_, nodal, contact_force_);
  if (contact_heat_) contact_heat(after, in, w_points, l);
}

// Heat that the contact conducts by its pressure and makes by friction.
template <int d>
void BalanceEvaluator<d>::contact_heat(const TimeLevel& after, const StepInputs& in, const Eigen::VectorXd& w,
                                       Balances& l) {
  const Eigen::VectorXd theta = at_points(after.theta);
  Eigen::VectorXd leaving = Eigen::VectorXd::Zero(surface_.points()), sizes = leaving;
  contact_heat_flow_.resize(surface_.points(), 2);
  const double rest = 1e-12 * in.contact_free.cwiseAbs().maxCoeff();  // a slip below is rounding
  for (Eigen::Index i = 0; i < surface_.points(); ++i) {
    const ContactPart& part = problem_.contacts[surface_.contact(i)];
    const Point<d> nu = surface_.normals().row(i).transpose(), velocity = w.template segment<d>(i * d),
                   slip = velocity - velocity.dot(nu) * nu, force = in.contact_force.template segment<d>(i * d);
    const double conducted = part.heat.per_pressure * std::max(force.dot(nu), 0.0) * (theta[i] - in.foundation[i]),
                 made = slip.norm() > rest ? part.heat.share * force.dot(slip) : 0;
    l.exchanged += in.k * conducted * theta[i];
    l.friction_heating += in.k * made * theta[i];
    leaving[i] = conducted - made;
    contact_heat_flow_.row(i) << conducted, made;
    sizes[i] =
        part.heat.per_pressure * std::max(force.dot(nu), 0.0) * (std::abs(theta[i]) + std::abs(in.foundation[i])) +
        std::abs(made);
  }
  place(nodes_, shape_.transpose() * leaving, contact_heat_);
  place(nodes_, shape_.transpose() * sizes, contact_heat_size_);
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
