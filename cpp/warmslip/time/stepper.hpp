// Backward Euler for problem (PF): one verb, advance().
#pragma once
#include <cmath>
#include <optional>

#include "warmslip/time/balances.hpp"
#include "warmslip/time/step_systems.hpp"

namespace warmslip {

/// `precision_lost`: the equations are solved to round-off and yet a field has fewer than four digits, see Digits.
/// `unsupported`: nothing holds the body in a step without inertia. `solver_failed`: a linear solve did not reach its
/// answer (iterative ones, by PETSc's options).
enum class Outcome {
  completed,
  contact_not_converged,
  not_finite,
  balance_violated,
  precision_lost,
  unsupported,
  solver_failed
};

/// The reason of the outcome `not_finite`.
inline constexpr const char* beyond_doubles = "a number overflowed; scale the data";
inline constexpr const char* squares_gone =
    "forces or velocities of friction are so small or so large that squares of them are no numbers; scale the data";

struct StepperOptions {
  double k;  ///< time step, until `set_step` changes it
  Coupling coupling;
  Backend backend = Backend::automatic;
  ContactOptions contact{};
  double refinement = 5e-12;      ///< equations that leave more get iterative refinement, see Balances::force_defect
  double row_refinement = 1e-12;  ///< as does a row that leaves more of its own terms, see Balances::force_residual
  int passes = 6;                 ///< of it at most, while they help
  double balance_bound = 1e-10;   ///< a step whose balances leave more is rejected, see Balances::energy_residual
  double error_bound = 1e-4;      ///< nor is one whose fields are known no better than this, see Digits
  double factor_bytes = 1e9;      ///< bound on the factors of step sizes that are kept for another use
  int measured_steps = 32;        ///< digits are estimated in step 1, in this one, in its square and so on, and in
                                  ///< steps in which more than twice as many points touch as in the one before
};

/// Estimated relative errors of the fields of a step, from what a step of iterative refinement changes in them (contact
/// included), against the largest value of the field so far; nan where the field is absent or was not measured. The
/// digits are minus their decimal logarithms.
struct Errors {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  double u = unknown, theta = unknown, stress = unknown, contact_force = unknown;

  double largest() const;
  bool measured() const {
    return !(std::isnan(u) && std::isnan(theta) && std::isnan(stress) && std::isnan(contact_force));
  }
};

/// What is known of a field so far: its largest value, that or what rounding of the other fields may make of it if this
/// is larger (its errors are relative to `scale`), and its largest estimated change.
struct Extent {
  double size = 0, scale = 0, change = 0;
  double tried = 0;  ///< the change of the step that is being taken
};
struct FieldExtents {
  Extent u, theta, stress, contact_force;
  double force = 0;                                  ///< the largest nodal force so far
  double speed = 0;                                  ///< the largest velocity so far
  double looked = 0;                                 ///< the size of u when the stress was looked at last
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();  ///< the largest displacement so far, by axis

  std::array<Extent*, 4> all() { return {&u, &theta, &stress, &contact_force}; }
};

/// Data of one step: load vectors `force` (f, v) and `heat` (q, eta), k_c theta_F included, `gap` g (points); what
/// belongs to an absent block is null or empty.
struct StepLoads {
  Vec force = nullptr, heat = nullptr;
  Eigen::VectorXd gap{};
  /// Where supports move or are warm: vectors whose entries at the fixed unknowns are the given velocity and
  /// temperature; null: zero.
  Vec support_velocity = nullptr, support_temperature = nullptr;
  Eigen::VectorXd foundation{};  ///< theta_F (points), where the conductance depends on the pressure
  /// Velocity of the foundation at the contact points, (d points), of which the law sees the tangential part; empty: 0.
  Eigen::VectorXd foundation_velocity{};
  bool measured = false;                                   ///< digits are estimated in this step whatever its number
  double time = std::numeric_limits<double>::quiet_NaN();  ///< at the end of the step; nan: k after the last one
};

template <int d>
struct StepReport {
  Outcome outcome = Outcome::completed;
  std::string reason;  ///< of a step that was rejected, in words, where more can be said than its name
  Stage stage = Stage::none;
  int newton_iterations = 0;
  int open = 0, stick = 0, slip = 0;
  double max_penetration = 0;                     ///< length
  double normal_force = 0;                        ///< int p_nu, force
  Point<d> traction = Point<d>::Zero();           ///< int sigma nu over Gamma_C: the foundation's force on the body
  Point<d> friction_traction = Point<d>::Zero();  ///< its tangential part
  Balances balances{};
  Errors errors{};
  bool undetermined = false;  ///< a change of the loads has no definite answer
};

/// What a run costs, so far.
struct Cost {
  double setup_seconds = 0, step_seconds = 0;  ///< CPU of this process
  /// Parts of a step in elapsed time: solves with their right-hand sides, the contact solver, the balances.
  double momentum_seconds = 0, contact_seconds = 0, heat_seconds = 0, balance_seconds = 0;
  int steps = 0, refinements = 0, substitutions = 0, factorizations = 0, dense_factorizations = 0,
      newton_iterations = 0;
  int estimates = 0;  ///< steps whose digits were estimated, whose substitutions are not among those above
  double factor_bytes = 0;
};

template <int d>
class Stepper {
 public:
  /// Factors the operators of `problem` for the step size of `options`.
  Stepper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
          const ContactSurface<d>& surface, StepperOptions options);
  /// A stepper for a problem that differs from that of `like` in loads, contact laws and initial data alone: it has the
  /// same layout, operators, surface and options, and shares the factors. One of the two may step at a time.
  Stepper(const Problem<d>& problem, const Stepper& like);

  /// The size of the next steps (collective). Factors that are kept are used again. Throws std::invalid_argument for
  /// a size that is not positive, or for which an operator cannot be factored; the size stays as it was then.
  void set_step(double k);
  double step() const { return systems_->k; }
  /// Whether factors for a step size are kept.
  bool has_factored(double k) const { return cache_->find(k) != nullptr; }
  /// About how many steps the factorization for another step size costs, from the counts of their operations.
  double refactoring_price() const;

  /// Sets the initial data (2.11); `gap` at the contact points. Fields the problem does not have are null. A run that
  /// goes on passes the contact forces and statuses of its last step and the extents so far as well, and for a body
  /// without supports how its motion was parted: the next step is then the same to the last bit as that of a stepper
  /// that called `clear_cache` there.
  void start(Vec u, Vec w, Vec theta, const Eigen::VectorXd& gap, double time = 0);
  void resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status, const FieldExtents& extents,
              int taken);
  /// After `start`: displacement and velocity of a body without supports but for rigid motions, and the velocities of
  /// those.
  void part(Vec strained, Vec strained_w, const Eigen::VectorXd& rigid);
  /// Drops what is remembered of earlier steps beside the state.
  void clear_cache();
  /// One step. When the outcome is not `completed`, the state is the last good one.
  StepReport<d> advance(const StepLoads& loads);
  /// Takes the last step back, which was completed; once for each step.
  void revert();

  const TimeLevel& level() const { return now_; }
  double time() const { return time_; }
  int steps() const { return cost_.steps; }
  const Eigen::VectorXd& contact_force() const { return contact_force_; }  ///< (d points), force on the foundation
  const std::vector<Status>& status() const { return status_; }
  const FieldExtents& extents() const { return extents_; }
  /// Forces of the supports on the body in the last step, nodal; null without motion.
  const VecHandle& reactions() const { return evaluator_.reactions(); }
  /// Heat per time from the supports of the temperature in the last step, nodal; null without heat.
  const VecHandle& support_heat() const { return evaluator_.support_heat(); }
  /// See BalanceEvaluator.
  const Eigen::MatrixX2d& contact_heat_flow() const { return evaluator_.contact_heat_flow(); }
  const ContactSolver<d>* contact_solver() const {
    return systems_->contact.get();
  }                                                          ///< nullptr without contact points
  const ContactProblem<d>& posed() const { return posed_; }  ///< of the step tried last
  const Cost& cost() const { return cost_; }
  Factor* momentum_factor() { return systems_->momentum.get(); }  ///< nullptr without motion
  Factor* heat_factor() { return systems_->heat.get(); }          ///< nullptr without heat and when monolithic
  std::string solver() const;

 private:
  /// Heat that contact nodes lose by what they are warmer than the foundation, and what they receive whatever they are.
  struct NodalFlow {
    Eigen::MatrixXd lost;
    Eigen::VectorXd given;
  };

  struct Motion {
    VecHandle w, strained_w, theta;
    Eigen::VectorXd rigid, free;
    ContactSolution<d> contact;
  };

  void take_state();
  StepReport<d> attempt(const StepLoads& loads);
  void take_vectors();
  void momentum_right_side(const StepLoads& loads, const Eigen::VectorXd& from);
  Eigen::VectorXd reduce(Vec right, Vec external);
  Eigen::VectorXd expand(const ContactSolution<d>& contact, Vec w, Vec theta);
  void heat_right_side(const StepLoads& loads, Vec heating_w, double scale);
  StepReport<d> conclude(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact);
  void products(TimeLevel& level) const;
  bool solve_contact(const Eigen::VectorXd& guess, ContactSolution<d>& solution);
  void guide(Vec given) const;
  void apply_contact_velocity(const ContactSolution<d>& contact, Vec w, Vec moved) const;
  bool solve_motion(const StepLoads& loads, ContactSolution<d>& contact);
  bool reach_motion(const StepLoads& loads, const Eigen::VectorXd& from, ContactSolution<d>& contact);
  void solve_heat(const StepLoads& loads, Vec heating_w);
  void solve_heat(Vec right, Vec external, const Eigen::VectorXd& given, const Eigen::VectorXd& beside, Vec out);
  NodalFlow flow(const StepLoads& loads, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity) const;
  Balances balance(const StepInputs& inputs);
  Errors weighed() const;
  bool closed(const Balances& balances) const;
  Outcome outcome_of(const Balances& balances) const;
  std::string why(Outcome outcome, const Balances& balances) const;
  StepInputs complete(const StepLoads& loads, const ContactSolution<d>& contact);
  StepInputs inputs(const StepLoads& loads, const ContactSolution<d>& contact) const;
  Balances refine(const StepLoads& loads, Balances balances, ContactSolution<d>& contact);
  bool correct_motion(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact,
                      std::optional<int> sample = {});
  void correct_heat(const StepInputs& inputs, const Balances& balances, std::optional<int> sample = {});
  void estimate(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact, bool moved, bool warmed);
  void forget_errors();
  void note_sizes(const ContactSolution<d>& contact);
  void settle_rest();
  static void note(double& error, Extent& field, double change, double size, double least);
  bool respond(const Eigen::VectorXd& correction, const std::vector<bool>& resting, ContactSolution<d>& contact);
  double change_of_pressure(const Eigen::VectorXd& change, const ContactSolution<d>& contact) const;
  double change_at_rest(const Eigen::VectorXd& cause, const ContactSolution<d>& contact);
  Motion motion_of(const ContactSolution<d>& contact) const;
  void undo(const Motion& motion, ContactSolution<d>& contact);
  Eigen::VectorXd creep(const ContactSolution<d>& contact) const;
  Eigen::VectorXd rounding(const Eigen::VectorXd& velocity) const;
  Eigen::VectorXd sliding(Vec w) const;
  void note_temperature(const Balances& balances);
  void coupled_heat_defect(const StepInputs& inputs, std::optional<int> sample);
  Balances balances_of(const StepLoads& loads, const ContactSolution<d>& contact);
  void add_heat_of_error(const StepLoads& loads);
  void add_stress_of_temperature();
  void add_motion_of_error(const ContactSolution<d>& contact);
  void add_drift(const Eigen::VectorXd& motions, bool lands);
  void split(Vec coupled, Vec w, Vec theta) const;
  void join(Vec momentum, Vec heat, Vec coupled) const;
  void hold(Vec v, Vec given) const;
  static void fix(Vec v, const std::vector<PetscInt>& indices, Vec given, double scale = 1);
  bool monolithic() const { return options_.coupling == Coupling::monolithic && systems_->momentum && now_.theta; }
  bool reactive() const { return systems_->heat && surface_.points() > 0 && problem_.contact_heats(); }
  void add_coasting();
  bool measured_now(const StepLoads& loads, const ContactSolution<d>& contact) const;
  bool iterative() const;
  bool in_range(const Eigen::VectorXd& values) const;
  bool squares_vanish(const StepLoads& loads, const ContactSolution<d>& contact) const;
  int substitutions() const;

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  StepperOptions options_;
  BalanceEvaluator<d> evaluator_;
  std::shared_ptr<SystemCache<d>> cache_;
  std::shared_ptr<StepSystems<d>> systems_;  // of the present step size
  TimeLevel now_, next_;
  VecHandle momentum_right_, heat_right_, coupled_right_, coupled_, correction_w_, correction_theta_;
  VecHandle correction_strained_;                // the correction but for a rigid motion
  VecHandle beside_shape_;                       // u but for what strains, of a body that springs hold
  Eigen::VectorXd correction_force_;             // of the contact points
  VecHandle momentum_external_, heat_external_;  // right-hand sides without inner forces, for motions solved for apart
  VecHandle warmer_;                             // the temperature less that of reference
  std::vector<bool> fixed_contact_;              // of the contact nodes, those whose temperature is held
  Eigen::VectorXd drive_;                        // tangential velocity of the foundation at the contact points
  Eigen::VectorXd free_;        // velocity of the contact points without contact force, relative to the foundation
  Eigen::VectorXd rigid_load_;  // load on the rigid motions
  NodalFlow flow_;
  Eigen::VectorXd beside_;   // temperature of the foundation at the contact nodes
  ContactProblem<d> posed_;  // the contact problem that was solved last
  Eigen::VectorXd contact_force_;
  std::vector<Status> status_;
  Errors errors_;  // of the step that is being taken
  FieldExtents extents_;
  struct Before {
    Eigen::VectorXd contact_force;
    std::vector<Status> status;
    FieldExtents extents;
    double time;
  };
  std::optional<Before> before_;  // the last step, whose levels are in `next_`
  bool undetermined_ = false;
  double grazing_ = 1;  // the contact force over a hundredth of the largest force, at most 1
  double time_ = 0;
  int taken_ = 0;  // steps, those before the state that was given included
  Cost cost_;
};

}  // namespace warmslip
