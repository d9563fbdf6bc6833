// The heat equation at every node, and the heat balance of the whole body.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "warmslip/time/balances.hpp"

namespace warmslip {

// A temperature that rounding of the velocity makes through the heating: at a node against all that holds its
// temperature, and of the whole body, where none is given, against what holds the constant.
template <int d>
double BalanceEvaluator<d>::temperature_of_rounding(const TimeLevel& before, const TimeLevel& after, double k) const {
  const double here = relative(heating_.largest, mass_.largest / k + conduction_.largest + exchange_.largest),
               whole = any_temperature_prescribed_ ? 0 : relative(heating_.sum, mass_.sum / k + exchange_.sum);
  return 1e-10 * std::max(after.sizes.w, before.sizes.w) * std::max(here, whole);
}

// The heat balance tested with k theta_n and with 1, and its equation at every free node.
template <int d>
void BalanceEvaluator<d>::heat(const TimeLevel& before, const TimeLevel& after, const StepInputs& in, Balances& l) {
  const double stored_before = 0.5 * dot(before.theta, before.mass_theta),
               stored = 0.5 * dot(after.theta, after.mass_theta);
  double content = 0, content_size = 0, work = 0;
  enum { defect, backward, acting };
  std::array<double, 3> largest{};
  const auto raise = [&](std::size_t which, double value) { largest[which] = std::max(largest[which], value); };
  const double theta = after.sizes.theta, both = std::max(theta, before.sizes.theta), w = in.coupling_w;
  // a velocity that strains is known to the rounding of one that carries the body: a millionth is as far from it as
  // round-off is from the bound on a balance
  const double carried = std::max(0.0, 1e-6 * std::max(after.sizes.w, before.sizes.w) - w);
  {
    Values t1(after.mass_theta), t0(before.mass_theta), q(in.heat), h(in.heating_w), flux(conducted_), x(exchanged_),
        c(contact_heat_), sizes(contact_heat_size_), values(after.theta), old(before.theta), given_there(support_heat_);
    const auto at = [](auto&& v, PetscInt i) { return v.size() ? v[i] : 0.0; };
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const double storage = ((*t1)[i] - (*t0)[i]) / in.k, supply = at(*q, i), heating = at(*h, i),
                   exchange = at(*x, i) + at(*c, i);
      const double external = storage + exchange - supply - heating, wall = external + (*flux)[i];
      const double given = std::abs(exchange) + std::abs(supply) + std::abs(heating);
      const double terms = given + 2 * both * mass_rows_[i] / in.k + theta * conduction_rows_[i] +
                           theta * at(exchange_rows_, i) + at(*sizes, i) + w * at(heating_rows_, i),
                   magnitude = terms + carried * at(heating_rows_, i);
      const bool prescribed = temperature_prescribed_[static_cast<std::size_t>(i)];
      content += prescribed ? external - wall : external;
      content_size += magnitude;
      if (stores_magnitudes_) {
        heat_magnitudes_[i] = prescribed ? 0 : terms;
        heat_external_[i] = prescribed ? 0 : terms - theta * conduction_rows_[i];
      }
      if (prescribed) {
        l.support_heat += in.k * wall * (*values)[i];
        (*given_there)[i] = wall;
      } else {
        raise(defect, std::abs(wall));
        if (magnitude > std::numeric_limits<double>::min()) raise(backward, std::abs(wall) / magnitude);
        if (!std::isfinite(wall)) raise(backward, std::numeric_limits<double>::infinity());
      }
      work += in.k * magnitude * (std::abs((*values)[i]) + std::abs((*old)[i]));
      raise(acting, std::max({(std::abs((*t1)[i]) + std::abs((*t0)[i])) / in.k, std::abs((*flux)[i]), given}));
    }
  }
  Eigen::VectorXd all(4);
  all << l.support_heat, content, content_size, work;
  all = layout_.sum(std::move(all));
  l.support_heat = all[0];
  l.heat_change = stored - stored_before;
  l.heat_damping = 0.5 * dot_of_changes(layout_, after.theta, before.theta, after.mass_theta, before.mass_theta);
  l.conducted = in.k * dot(after.theta, conducted_);
  l.exchanged += in.k * dot(after.theta, exchanged_);
  l.supplied = in.k * dot(in.heat, after.theta);
  l.heating = in.k * dot(in.heating_w, after.theta);
  const double sum = l.heat_change + l.heat_damping + l.conducted + l.exchanged - l.supplied - l.heating -
                     l.friction_heating - l.support_heat;
  largest = over_ranks(layout_.comm(), largest);
  l.heat_residual = std::max({largest[backward], relative(all[1], all[2]),
                              relative(sum, largest_of({stored, stored_before, l.heat_damping, l.conducted, l.exchanged,
                                                        l.supplied, l.heating, l.friction_heating, l.support_heat}) +
                                                all[3])});
  l.heat_defect = relative(largest[defect], largest[acting]);
  l.temperature_scale = temperature_of_rounding(before, after, in.k);
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
