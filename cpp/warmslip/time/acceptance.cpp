// Whether a step becomes the state, and the reason where it does not.
#include <algorithm>
#include <cmath>

#include "warmslip/time/stepper.hpp"

namespace warmslip {

template <int d>
bool Stepper<d>::closed(const Balances& l) const {
  const double bound = options_.balance_bound;
  return l.heat_residual <= bound && l.force_residual <= bound && l.energy_residual <= bound && l.law_residual <= bound;
}

// Only a step whose balances close becomes the state.
template <int d>
Outcome Stepper<d>::outcome_of(const Balances& l) const {
  if (!std::isfinite(l.kinetic + l.elastic + l.contact + l.viscous + l.load_work + l.conducted + l.heat_change))
    return Outcome::not_finite;
  if (!closed(l)) return Outcome::balance_violated;
  return weighed().largest() <= options_.error_bound ? Outcome::completed : Outcome::precision_lost;
}

// Whether friction is so large, or was so small in the whole run, that squares of it have no digits.
template <int d>
bool Stepper<d>::squares_vanish(const StepLoads& loads, const ContactSolution<d>& contact) const {
  constexpr double large = 1e140, small = 1 / large;
  const bool rubs =
      std::any_of(posed_.laws.begin(), posed_.laws.end(), [](auto& law) { return law.friction.present(); });
  const double force = rubs && contact.force.size() > 0 ? contact.force.template lpNorm<Eigen::Infinity>() : 0;
  if (force == 0) return false;
  const double free = free_.template lpNorm<Eigen::Infinity>(), so_far = std::max(force, extents_.contact_force.size);
  if (std::max(force, free) > large) return true;
  return loads.measured && (so_far < small || (force > 1e-10 * so_far && free > 0 && free < small));
}

// Whether PETSc's options put an iterative solver in the place of a factorization.
template <int d>
bool Stepper<d>::iterative() const {
  return (systems_->momentum && layout_.sum(systems_->momentum->bytes()) == 0) ||
         (systems_->heat && layout_.sum(systems_->heat->bytes()) == 0);
}

// The reason for which a step is rejected.
template <int d>
std::string Stepper<d>::why(Outcome outcome, const Balances& l) const {
  const double bound = options_.balance_bound;
  std::string names;
  const auto list = [&](const char* name) { names += (names.empty() ? "" : " and ") + std::string(name); };
  switch (outcome) {
    case Outcome::not_finite:
      return beyond_doubles;
    case Outcome::precision_lost:
      for (const auto& [name, error] :
           {std::pair{"u", errors_.u}, std::pair{"theta", errors_.theta}, std::pair{"the stress", errors_.stress},
            std::pair{"the contact force", weighed().contact_force}})
        if (std::isgreater(error, options_.error_bound)) list(name);
      return "fewer than four digits of " + names +
             " can be trusted: the equations are solved to round-off, but their operator is too ill-conditioned for "
             "double "
             "precision; shorten the steps, or bring stiffnesses and lengths nearer to each other";
    case Outcome::balance_violated: {
      for (const auto& [name, residual] : {std::pair{"energy", l.energy_residual}, std::pair{"heat", l.heat_residual},
                                           std::pair{"force", l.force_residual}, std::pair{"law", l.law_residual}})
        if (!(residual <= bound)) list(name);
      return names + (iterative()
                          ? " residual above 1e-10 after iterative refinement: the linear solver tolerance is too loose"
                          : " residual above 1e-10 after iterative refinement: terms of the step cancel beyond double "
                            "precision; shorten the steps, or bring stiffnesses and lengths nearer to each other");
    }
    default:
      return "";
  }
}

// The errors that may end a run: that of a contact that hardly touches is seen beside the other forces.
template <int d>
Errors Stepper<d>::weighed() const {
  Errors out = errors_;
  out.contact_force *= grazing_;
  return out;
}

template class Stepper<2>;
template class Stepper<3>;

}  // namespace warmslip
