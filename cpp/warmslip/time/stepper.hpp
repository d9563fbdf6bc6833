// Backward Euler for problem (PF): one verb, advance().
#pragma once
#include "warmslip/contact/solver.hpp"
#include "warmslip/fem/rigid_motions.hpp"
#include "warmslip/la/factor.hpp"
#include "warmslip/time/balances.hpp"

namespace warmslip {

/// Which time level the coupling terms take: (theta_{n-1}, w_n), (theta_{n-1}, w_{n-1}) or (theta_n, w_n).
enum class Coupling { staggered, lagged, monolithic };

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

struct StepperOptions {
  double k;  ///< time step
  Coupling coupling;
  Backend backend = Backend::automatic;
  ContactOptions contact{};
  double refinement = 5e-12;      ///< equations that leave more get iterative refinement, see Balances::force_defect
  double row_refinement = 1e-12;  ///< as does a row that leaves more of its own terms, see Balances::force_residual
  int passes = 6;                 ///< of it at most, while they help
  double balance_bound = 1e-10;   ///< a step whose balances leave more is rejected, see Balances::energy_residual
  double error_bound = 1e-4;      ///< nor is one whose fields are known no better than this, see Digits
  int measured_steps = 32;        ///< digits are estimated in step 1, in this one, in its square and so on, and in
                                  ///< steps that touch the foundation after one that did not
};

/// Estimated relative errors of the fields of a step, from what a step of iterative refinement changes in them (contact
/// included), against the largest value of the field so far; nan where the field is absent or was not measured. The
/// digits are minus their decimal logarithms.
struct Errors {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  double u = unknown, theta = unknown, stress = unknown, contact_force = unknown;

  double largest() const;
};

/// What is known of a field so far: its largest value, that or what rounding of the other fields may make of it if this
/// is larger (its errors are relative to `scale`), and its largest estimated change.
struct Extent {
  double size = 0, scale = 0, change = 0;
  double tried = 0;  ///< the change of the step that is being taken
};
struct FieldExtents {
  Extent u, theta, stress, contact_force;
  double force = 0;  ///< the largest nodal force so far

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
  bool measured = false;         ///< digits are estimated in this step whatever its number
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
  /// Parts of step_seconds: solves with their right-hand sides, the contact solver, the balances.
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

  /// Sets the initial data (2.11); `gap` at the contact points. Fields the problem does not have are null. A run that
  /// goes on passes the contact forces and statuses of its last step and the extents so far as well, and for a body
  /// without supports how its motion was parted: the next step is then the same to the last bit as that of a stepper
  /// that called `clear_cache` there.
  void start(Vec u, Vec w, Vec theta, const Eigen::VectorXd& gap, double time = 0);
  void resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status, const FieldExtents& extents);
  /// After `start`: displacement and velocity of a body without supports but for rigid motions, and the velocities of
  /// those.
  void part(Vec strained, Vec strained_w, const Eigen::VectorXd& rigid);
  /// Drops what is remembered of earlier steps beside the state.
  void clear_cache();
  /// One step. When the outcome is not `completed`, the state is the last good one.
  StepReport<d> advance(const StepLoads& loads);

  const TimeLevel& level() const { return now_; }
  double time() const { return time_; }
  int steps() const { return cost_.steps; }
  const Eigen::VectorXd& contact_force() const { return contact_force_; }  ///< (d points), force on the foundation
  const std::vector<Status>& status() const { return status_; }
  const FieldExtents& extents() const { return extents_; }
  const ContactSolver<d>* contact_solver() const { return contact_.get(); }  ///< nullptr without contact points
  const ContactProblem<d>& posed() const { return posed_; }                  ///< of the step tried last
  const Cost& cost() const { return cost_; }
  Factor* momentum_factor() { return momentum_.get(); }  ///< nullptr without motion
  Factor* heat_factor() { return heat_.get(); }          ///< nullptr without heat and when monolithic
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
  void take_factors();
  void take_motion(Mat a, int width, Symmetry symmetry, const std::string& name);
  std::vector<std::string> parts_in_contact(bool mechanical) const;
  void take_vectors();
  void momentum_right_side(const StepLoads& loads, const Eigen::VectorXd& from);
  Eigen::VectorXd reduce(Vec right, Vec external);
  Eigen::VectorXd expand(const ContactSolution<d>& contact, Vec w, Vec theta);
  void heat_right_side(const StepLoads& loads, Vec heating_w, double scale);
  StepReport<d> conclude(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact);
  void products(TimeLevel& level) const;
  bool solve_contact(const Eigen::VectorXd& guess, ContactSolution<d>& solution);
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
  bool correct_motion(const StepLoads& loads, const Balances& balances, ContactSolution<d>& contact, bool apply);
  void correct_heat(const StepInputs& inputs, const Balances& balances, bool apply);
  static void note(double& error, Extent& field, double change, double size, double least);
  bool respond(const Eigen::VectorXd& correction, ContactSolution<d>& contact);
  Motion motion_of(const ContactSolution<d>& contact) const;
  void undo(const Motion& motion, ContactSolution<d>& contact);
  Eigen::VectorXd creep(const ContactSolution<d>& contact) const;
  void note_temperature(const Balances& balances);
  void add_heat_of_error(const StepLoads& loads);
  void split(Vec coupled, Vec w, Vec theta) const;
  void join(Vec momentum, Vec heat, Vec coupled) const;
  static void fix(Vec v, const std::vector<PetscInt>& indices, Vec given, double scale = 1);
  bool monolithic() const { return options_.coupling == Coupling::monolithic && momentum_ && now_.theta; }
  bool reactive() const { return heat_ && surface_.points() > 0 && problem_.contact_heats(); }
  bool measured_now(const StepLoads& loads, const ContactSolution<d>& contact) const;
  bool iterative() const;
  bool in_range(const Eigen::VectorXd& values) const;
  int substitutions() const;

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  StepperOptions options_;
  BalanceEvaluator<d> evaluator_;
  double coupled_scale_ = 1;
  std::unique_ptr<Factor> momentum_, heat_;  // monolithic: momentum_ holds both fields
  RigidMotions rigid_, constants_;           // of motion and of heat, where nothing is prescribed
  std::unique_ptr<ContactSolver<d>> contact_;
  TimeLevel now_, next_;
  VecHandle momentum_right_, heat_right_, coupled_right_, coupled_, correction_w_, correction_theta_;
  VecHandle correction_strained_;                // the correction but for a rigid motion
  Eigen::VectorXd correction_force_;             // of the contact points
  Eigen::MatrixXd carried_;                      // velocities of the contact points in the rigid motions
  VecHandle momentum_external_, heat_external_;  // right-hand sides without inner forces, for rigid_ and constants_
  std::vector<bool> fixed_contact_;              // of the contact nodes, those whose temperature is held
  Eigen::VectorXd free_;                         // velocity of the contact points without contact force
  Eigen::VectorXd rigid_load_;                   // load on the rigid motions
  NodalFlow flow_;
  Eigen::VectorXd beside_;   // temperature of the foundation at the contact nodes
  ContactProblem<d> posed_;  // the contact problem that was solved last
  Eigen::VectorXd contact_force_;
  std::vector<Status> status_;
  Errors errors_;  // of the step that is being taken
  FieldExtents extents_;
  bool undetermined_ = false;
  double grazing_ = 1;  // the contact force over a hundredth of the largest force, at most 1
  double time_ = 0;
  Cost cost_;
};

}  // namespace warmslip
