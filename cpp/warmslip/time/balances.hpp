// The balances every step must close to round-off: energy, heat, force and moment, and the contact law itself.
// They are computed from the step's result with the un-eliminated operators, not from the solver's own residuals.
#pragma once
#include "warmslip/fem/rigid_motions.hpp"
#include "warmslip/time/roundoff.hpp"
#include "warmslip/time/time_level.hpp"

namespace warmslip {

/// Samples of rounding of which an estimate of errors takes the worst. Where one direction decides, one sample is ten
/// times too small in 6 % of all cases, and three are in one of 1,200 (compare Kenney & Laub, SIAM J. Sci. Comput. 15,
/// 1994).
constexpr int rounding_samples = 3;

template <int d>
class BalanceEvaluator {
 public:
  /// Of another problem with the same operators, a `like` one has their row sums and the hat functions.
  BalanceEvaluator(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                   const ContactSurface<d>& surface, const BalanceEvaluator* like = nullptr);

  /// Takes from the system of a step how much of the inner forces' rounding reaches the force and the moment of the
  /// body: all, but along those of its rigid motions that are solved for apart (collective).
  void take_shares(const RigidMotions& rigid, bool sprung);

  /// The balances of the step from `before` to `after` (collective).
  Balances evaluate(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs);
  /// Keeps the magnitudes of the equations of the step that was closed last, for `add_rounding` (collective).
  void store_magnitudes(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs);

  /// What the equations of the last closed step leave over, zero in the fixed rows: load minus response. `external`,
  /// where given, receives the part without inner forces (elastic, viscous, of expansion; conducted heat).
  void momentum_defect(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Vec out,
                       Vec external = nullptr) const;
  void heat_defect(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Vec out,
                   Vec external = nullptr) const;
  /// Forces of the supports on the body at the nodes in the step that was evaluated last, zero where nothing is held.
  const VecHandle& reactions() const { return reactions_; }
  /// Heat per time from the supports of the temperature into the body at the nodes, likewise; null without heat.
  const VecHandle& support_heat() const { return support_heat_; }
  /// Heat per time at the contact points in that step, (points, 2): what pressure conducts into the foundation, and
  /// what friction gives to the body. Empty where the contact does neither.
  const Eigen::MatrixX2d& contact_heat_flow() const { return contact_heat_flow_; }
  /// Adds to a defect what rounding of the operators' entries and of the sums may have in it, with signs that change
  /// from node to node, others for every sample: the unit round-off of the magnitudes of the equations' terms (Bauer &
  /// Skeel). `external`, if any, gets the same but for the inner terms, whose rounding moves no rigid body.
  void add_rounding(int sample, Vec defect, Vec external) const;

 private:
  Balances terms(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs);
  void contact(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Balances& balances);
  void contact_heat(const TimeLevel& after, const StepInputs& inputs, const Eigen::VectorXd& w, Balances& balances);
  void forces(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Balances& balances);
  void energy(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Balances& balances);
  void heat(const TimeLevel& before, const TimeLevel& after, const StepInputs& inputs, Balances& balances);
  double temperature_of_rounding(const TimeLevel& before, const TimeLevel& after, double k) const;
  void find_shape_functions();
  Eigen::VectorXd at_points(Vec v) const;
  void release(Vec forces) const;
  void place(const std::vector<PetscInt>& at, const Eigen::VectorXd& nodal, Vec out) const;

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  VecHandle viscous_w_, contact_force_, reactions_;     // B w, E lambda
  VecHandle springs_, dashpots_;                        // S u, S w of springs and dashpots
  VecHandle rigid_w_;                                   // w but for what strains, where dashpots resist it
  VecHandle conducted_, exchanged_, support_heat_;      // D theta, J theta
  VecHandle contact_heat_, contact_heat_size_;          // heat that leaves at the contact points, and its magnitudes
  Eigen::MatrixX2d contact_heat_flow_;                  // of the points, conducted and made by friction
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape_;  // hat functions at the contact points, found from positions
  struct RowSizes {
    double sum = 0, largest = 0;
  };
  RowSizes heating_, mass_, conduction_, exchange_;     // of the rows of the heat equation
  bool any_temperature_prescribed_ = false;             // whether a temperature is given
  Eigen::VectorXd force_magnitudes_, heat_magnitudes_;  // of the rows, zero where they are fixed
  Eigen::VectorXd force_external_, heat_external_;      // but for the inner forces and the conduction
  double work_magnitude_ = 0;  // in the step that is being closed: of all forces along all displacements
  Eigen::VectorXd inertia_rows_, elastic_rows_, viscous_rows_, expansion_rows_;  // sums of |entries|
  Eigen::VectorXd spring_rows_, dashpot_rows_;  // of every component: a weak spring may stand beside a strong one
  Eigen::VectorXd mass_rows_, conduction_rows_, exchange_rows_, heating_rows_;
  std::vector<PetscInt> unknowns_, nodes_;    // of contact, relative to the owned range
  std::vector<bool> temperature_prescribed_;  // a node
  std::vector<int> support_;                  // of a node in held_, -1 where it is free
  std::vector<Tensor2<d>> held_;              // projectors onto the directions in which the displacement is given
  using Resultants = Eigen::Vector<double, d*(d + 1) / 2>;  // along the axes, then about them
  bool sprung_ = false;                                     // whether springs resist the rigid motions
  Resultants shares_ = Resultants::Ones();                  // of the inner forces' rounding, see take_shares
  bool stores_magnitudes_ = false;             // whether the step that is being closed notes its magnitudes
  double stiffest_ = 0;                        // largest row of the elasticity
  double free_expansion_ = 0, reference_ = 0;  // displacement of the free body per temperature; reference temperature
  Point<d> centroid_;                          // moments are taken about it
};

}  // namespace warmslip
