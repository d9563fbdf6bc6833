// The balances every step must close to round-off: energy, heat, force and moment, and the contact law itself.
// They are computed from the step's result with the un-eliminated operators, not from the solver's own residuals.
#pragma once
#include "warmslip/contact_surface.hpp"
#include "warmslip/operators.hpp"

namespace warmslip {

/// What the ledger reads of one time level; what belongs to an absent block is null or empty.
struct Level {
  VecHandle u, w, theta;                      ///< displacement, velocity, temperature
  VecHandle momentum, elastic_u, mass_theta;  ///< rho M w, A u, M theta
  VecHandle expansion_theta, heating_w;       ///< G theta, E w
  Eigen::VectorXd contact_u, gap;             ///< u at the contact points (d points), g (points)
  Eigen::VectorXd contact_theta;              ///< theta at the contact points, where the contact makes or leads heat
};

/// Terms of one step in energy (d = 2: per length), as they stand in the balance; each dissipation is >= 0. Those of
/// absent blocks are zero.
struct Ledger {
  double kinetic, elastic, contact;  ///< stored at the end of the step
  double kinetic_change, elastic_change, contact_change;
  double inertia_damping, elastic_damping, contact_damping;  ///< backward Euler's own dissipation
  double viscous, friction;
  double load_work, expansion_work, gap_work, support_work;  ///< the last: of the reactions of moving supports
  /// the same balance for theta; `held`: of parts held at a temperature
  double heat_change, heat_damping, conducted, exchanged, supplied, heating, friction_heating, held;
  double energy_residual, heat_residual, force_residual, law_residual;  ///< relative to the largest term
  /// What rounding alone can cause, likewise: of the contact law, of the energy, of the internal
  /// forces (a body that moves far for its deformation has no digits left in its strain).
  double law_floor, energy_floor, force_floor;
};

struct StepInputs {
  double k;
  Vec force, heat;                 ///< load vectors
  Vec expansion_theta, heating_w;  ///< the ones the coupling used
  Eigen::VectorXd contact_force;   ///< at the points, (d points)
  Eigen::VectorXd contact_free;    ///< velocity the points would have without contact, for the law's scale
  double contact_scale;            ///< and a force of that size
  Eigen::VectorXd foundation;      ///< theta_F at the points, where the conductance depends on the pressure
};

template <int d>
class Bookkeeper {
 public:
  Bookkeeper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
             const ContactSurface<d>& surface);

  /// Closes the books of the step from `before` to `after` (collective).
  Ledger close(const Level& before, const Level& after, const StepInputs& inputs);

  /// What the equations of the last closed step leave over, zero in the fixed rows: load minus response.
  void momentum_defect(const Level& before, const Level& after, const StepInputs& inputs, Vec out) const;
  void heat_defect(const Level& before, const Level& after, const StepInputs& inputs, Vec out) const;

 private:
  void contact(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void forces(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void energy(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void heat(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void place(const std::vector<PetscInt>& at, const Eigen::VectorXd& nodal, Vec out) const;

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  VecHandle viscous_w_, contact_force_;             // B w, E lambda
  VecHandle conducted_, exchanged_, contact_heat_;  // D theta, J theta, heat that leaves at the contact points
  bool acted_on_ = false;     // in the step that is being closed: whether loads, contact or heat apply any force
  double work_size_ = 0;      // of loads and supports, as if all their forces were along the way
  double work_rounding_ = 0;  // sum of the squares of what rounding does to the work at the nodes, in units of eps
  Eigen::VectorXd elastic_rows_, viscous_rows_, conduction_rows_;  // sums of |entries|, for what rounding explains
  std::vector<PetscInt> unknowns_, nodes_;                         // of contact, relative to the owned range
  std::vector<bool> clamped_, cooled_;                             // a node
  Point<d> centroid_;                                              // moments are taken about it
};

}  // namespace warmslip
