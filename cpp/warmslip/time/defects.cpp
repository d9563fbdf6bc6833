// What a step leaves of its equations, as load vectors for its refinement and for the estimate of its digits.
#include <cstdint>
#include <limits>

#include "warmslip/time/balances.hpp"

namespace warmslip {
namespace {

// out += factor * v, if there is such a vector
void add(Vec out, double factor, Vec v) {
  if (v) WARMSLIP_PETSC(VecAXPY(out, factor, v));
}

// The sign of the rounding of an unknown in a sample, as if drawn by lot; the mixing is that of MurmurHash3.
bool is_up(std::uint32_t number, int sample) {
  if (sample == 0) return ((number * 2654435761u) >> 16 & 1u) != 0;
  std::uint32_t h = number + 0x9e3779b9u * static_cast<std::uint32_t>(sample);
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return ((h ^ h >> 16) & 1u) != 0;
}

}  // namespace

template <int d>
void BalanceEvaluator<d>::momentum_defect(const TimeLevel& before, const TimeLevel& after, const StepInputs& in,
                                          Vec out, Vec external) const {
  WARMSLIP_PETSC(VecCopy(in.force, out));
  add(out, -1, contact_force_);
  if (after.momentum) {
    Values values(out), m1(after.momentum), m0(before.momentum);
    *values -= (*m1 - *m0) / in.k;
  }
  if (external) {
    WARMSLIP_PETSC(VecCopy(out, external));
    if (sprung_) add(external, -1, springs_);
    if (sprung_) add(external, -1, dashpots_);
  }
  add(out, 1, in.expansion_theta);
  add(out, -1, viscous_w_);
  add(out, -1, after.elastic_u);
  release(out);
}

// Takes the forces off that supports bear.
template <int d>
void BalanceEvaluator<d>::release(Vec forces) const {
  Values values(forces);
  for (PetscInt i = 0; i < layout_.owned(); ++i) {
    const int support = support_[static_cast<std::size_t>(i)];
    if (support < 0) continue;
    auto here = (*values).template segment<d>(i * d);
    here -= (held_[static_cast<std::size_t>(support)] * here).eval();
  }
}

template <int d>
void BalanceEvaluator<d>::heat_defect(const TimeLevel& before, const TimeLevel& after, const StepInputs& in, Vec out,
                                      Vec external) const {
  WARMSLIP_PETSC(VecCopy(in.heat, out));
  add(out, 1, in.heating_w);
  add(out, -1, exchanged_);
  add(out, -1, contact_heat_);
  {
    Values values(out), m1(after.mass_theta), m0(before.mass_theta);
    *values -= (*m1 - *m0) / in.k;
  }
  if (external) WARMSLIP_PETSC(VecCopy(out, external));
  add(out, -1, conducted_);
  Values values(out);
  for (PetscInt i = 0; i < layout_.owned(); ++i)
    if (temperature_prescribed_[static_cast<std::size_t>(i)]) (*values)[i] = 0;
}

template <int d>
void BalanceEvaluator<d>::add_rounding(int sample, Vec defect, Vec external) const {
  const Eigen::Index block = block_size(defect);
  const Eigen::VectorXd &magnitudes = block == 1 ? heat_magnitudes_ : force_magnitudes_,
                        &outer = block == 1 ? heat_external_ : force_external_;
  {
    Values values(defect), outer_values(external);
    for (PetscInt i = 0; i < layout_.owned(); ++i)
      for (Eigen::Index a = 0; a < block; ++a) {
        const auto number = static_cast<std::uint32_t>(layout_.global_nodes()[static_cast<std::size_t>(i)] * 3 + a);
        const double sign = is_up(number, sample) ? 0.5 : -0.5;
        (*values)[i * block + a] += sign * std::numeric_limits<double>::epsilon() * magnitudes[i * block + a];
        if (external)
          (*outer_values)[i * block + a] += sign * std::numeric_limits<double>::epsilon() * outer[i * block + a];
      }
  }
  if (block == d) release(defect);
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
