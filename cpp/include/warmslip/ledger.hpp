// The balances every step must close to round-off: energy, heat, force and moment, and the contact law itself.
// They are computed from the step's result with the un-eliminated operators, not from the solver's own residuals.
#pragma once
#include "warmslip/contact_surface.hpp"
#include "warmslip/operators.hpp"

namespace warmslip {

/// What the ledger reads of one time level; what belongs to an absent block is null or empty.
struct Level {
  VecHandle u, w, theta;                      ///< displacement, velocity, temperature
  VecHandle strained, strained_w;             ///< u and w but for rigid motions, where the body has no support
  Eigen::VectorXd rigid;                      ///< and the velocities of the rigid motion that w has besides
  VecHandle momentum, elastic_u, mass_theta;  ///< rho M w, A u, M theta
  VecHandle expansion_theta, heating_w;       ///< G theta, E w
  Eigen::VectorXd contact_u, gap;             ///< u at the contact points (d points), g (points)
  Eigen::VectorXd contact_force;              ///< lambda of the step that ends here (d points)

  struct {
    double u = 0, w = 0, straining = 0, theta = 0;
  } sizes;  ///< largest entries, of u the part that inner forces see

  /// The displacement and the velocity that inner forces see.
  Vec shape() const { return strained ? strained : u; }
  Vec straining() const { return strained_w ? strained_w : w; }
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
  /// Backward errors: what a balance leaves over, against the sum of the magnitudes of what was added in it, with
  /// |A| |u| for the products in it. A step that is solved to round-off has round-off here, however small its forces
  /// are. The force residual is the largest over the equations of all nodes (Oettli & Prager, Numer. Math. 6, 1964) and
  /// over force and moment; where the body has no support, inner forces have no part in the magnitudes of the latter.
  double energy_residual, heat_residual, force_residual, law_residual;
  /// What the equations of the nodes leave over against the largest force (flow of heat) that acts in them: says
  /// whether the answer may be wrong, which an ill-conditioned operator makes possible in spite of round-off residuals.
  double force_defect, heat_defect;
  double displacement_scale;  ///< a displacement that makes forces of rounding
  double temperature_scale;   ///< a temperature that rounding of the velocity makes
  double force_scale;    ///< the largest force at a node beside its inertia: what errors of forces are compared with
  double contact_scale;  ///< a contact force that is none beside it
};

struct StepInputs {
  double k;
  Vec force, heat;                    ///< load vectors
  Vec expansion_theta, heating_w;     ///< the ones the coupling used
  double coupling_theta, coupling_w;  ///< largest temperature of the former and straining velocity of the latter
  Eigen::VectorXd contact_force;      ///< at the points, (d points)
  Eigen::VectorXd contact_free;       ///< velocity the points would have without contact, for the size of its terms
  Eigen::VectorXd foundation;         ///< theta_F at the points, where the conductance depends on the pressure
};

template <int d>
class Bookkeeper {
 public:
  Bookkeeper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
             const ContactSurface<d>& surface);

  /// How much of the inner forces' rounding reaches the rigid motions of a body without supports, in [0, 1].
  void rigid_share(double share) { rigid_share_ = share; }

  /// Closes the books of the step from `before` to `after` (collective).
  Ledger close(const Level& before, const Level& after, const StepInputs& inputs);
  /// Keeps the magnitudes of the equations of the step that was closed last, for `add_rounding` (collective).
  void weigh(const Level& before, const Level& after, const StepInputs& inputs);

  /// What the equations of the last closed step leave over, zero in the fixed rows: load minus response. `external`,
  /// where given, receives the part without inner forces (elastic, viscous, of expansion; conducted heat).
  void momentum_defect(const Level& before, const Level& after, const StepInputs& inputs, Vec out,
                       Vec external = nullptr) const;
  void heat_defect(const Level& before, const Level& after, const StepInputs& inputs, Vec out,
                   Vec external = nullptr) const;
  /// Adds to a defect what rounding of the operators' entries and of the sums may have in it, with signs that change
  /// from node to node: the unit round-off of the magnitudes of the equations' terms (Bauer & Skeel). `external`, if
  /// any, gets the same but for the inner terms, whose rounding moves no rigid body.
  void add_rounding(Vec defect, Vec external) const;

 private:
  Ledger terms(const Level& before, const Level& after, const StepInputs& inputs);
  void contact(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void contact_heat(const Level& after, const StepInputs& inputs, const Eigen::VectorXd& w, Ledger& ledger);
  void forces(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void energy(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  void heat(const Level& before, const Level& after, const StepInputs& inputs, Ledger& ledger);
  double temperature_of_rounding(const Level& before, const Level& after, double k) const;
  void interpolate_anew();
  Eigen::VectorXd at_points(Vec v) const;
  void place(const std::vector<PetscInt>& at, const Eigen::VectorXd& nodal, Vec out) const;

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  VecHandle viscous_w_, contact_force_;         // B w, E lambda
  VecHandle conducted_, exchanged_;             // D theta, J theta
  VecHandle contact_heat_, contact_heat_size_;  // heat that leaves at the contact points, and its magnitudes
  Eigen::SparseMatrix<double, Eigen::RowMajor>
      shape_;  // hat functions at the contact points, found anew from positions
  struct RowSizes {
    double sum = 0, most = 0;
  };
  RowSizes heating_, mass_, conduction_, exchange_;     // of the rows of the heat equation
  bool any_cooled_ = false;                             // whether a temperature is given
  Eigen::VectorXd force_magnitudes_, heat_magnitudes_;  // of the rows, zero where they are fixed
  Eigen::VectorXd force_external_, heat_external_;      // but for the inner forces and the conduction
  double work_magnitude_ = 0;  // in the step that is being closed: of all forces along all displacements
  Eigen::VectorXd inertia_rows_, elastic_rows_, viscous_rows_, expansion_rows_;  // sums of |entries|
  Eigen::VectorXd mass_rows_, conduction_rows_, exchange_rows_, heating_rows_;
  std::vector<PetscInt> unknowns_, nodes_;  // of contact, relative to the owned range
  std::vector<bool> clamped_, cooled_;      // a node
  double rigid_share_ = 1;
  bool keeps_ = false;                         // whether the step that is being closed notes its magnitudes
  double stiffest_ = 0;                        // largest row of the elasticity
  double free_expansion_ = 0, reference_ = 0;  // displacement of the free body per temperature; reference temperature
  Point<d> centroid_;                          // moments are taken about it
};

}  // namespace warmslip
