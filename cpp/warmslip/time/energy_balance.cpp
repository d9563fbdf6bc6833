// The energy balance of a step.
#include "warmslip/time/balances.hpp"

namespace warmslip {

// Momentum tested with k w_n.
template <int d>
void BalanceEvaluator<d>::energy(const TimeLevel& before, const TimeLevel& after, const StepInputs& in, Balances& l) {
  const auto elastic = [](const TimeLevel& at) {
    return 0.5 * (dot(at.shape(), at.elastic_u) + dot(at.u, at.sprung) - dot(at.shape(), at.sprung));
  };
  const double kinetic_before = 0.5 * dot(before.w, before.momentum), elastic_before = elastic(before);
  l.kinetic = 0.5 * dot(after.w, after.momentum);
  l.elastic = elastic(after);
  l.kinetic_change = l.kinetic - kinetic_before;
  l.elastic_change = l.elastic - elastic_before;
  l.inertia_damping = 0.5 * dot_of_changes(layout_, after.w, before.w, after.momentum, before.momentum);
  l.elastic_damping = 0.5 * dot_of_changes(layout_, after.shape(), before.shape(), after.elastic_u, before.elastic_u);
  if (after.sprung)  // of springs that a rigid motion strains
    l.elastic_damping += 0.5 * (dot_of_changes(layout_, after.u, before.u, after.sprung, before.sprung) -
                                dot_of_changes(layout_, after.shape(), before.shape(), after.sprung, before.sprung));
  l.viscous = in.k * dot(after.straining(), viscous_w_);
  if (sprung_) l.viscous += in.k * (dot(after.w, dashpots_) - dot(after.strained_w, dashpots_));
  l.load_work = in.k * dot(in.force, after.w);
  l.expansion_work = in.k * dot(in.expansion_theta, after.w);
  const double contact_before = l.contact - l.contact_change;
  const double sum = l.kinetic_change + l.elastic_change + l.contact_change + l.inertia_damping + l.elastic_damping +
                     l.contact_damping + l.viscous + l.friction - l.load_work - l.expansion_work - l.gap_work -
                     l.support_work - l.foundation_work;
  l.energy_residual = relative(
      sum, largest_of({l.kinetic, kinetic_before, l.elastic, elastic_before, l.contact, contact_before, l.viscous,
                       l.friction, l.load_work, l.expansion_work, l.gap_work, l.support_work, l.foundation_work}) +
               work_magnitude_);
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
