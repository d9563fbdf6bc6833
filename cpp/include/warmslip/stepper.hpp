// Backward Euler for problem (PF): one verb, advance().
#pragma once
#include "warmslip/contact_solver.hpp"
#include "warmslip/factor.hpp"
#include "warmslip/ledger.hpp"

namespace warmslip {

/// Which time level the coupling terms take: (theta_{n-1}, w_n), (theta_{n-1}, w_{n-1}) or (theta_n, w_n).
enum class Coupling { staggered, lagged, monolithic };

/// `precision_lost`: rounding of the displacement hides the pressure of a stiff foundation or the strain of a body that
/// moves far, see Ledger::law_floor and force_floor. `solver_failed`: a linear solve did not reach its answer
/// (iterative ones, by PETSc's options).
enum class Outcome { right, contact_not_converged, not_finite, identity_violated, precision_lost, solver_failed };

struct StepperOptions {
  double k;  ///< time step
  Coupling coupling;
  Backend backend = Backend::automatic;
  ContactOptions contact{};
  double refinement = 5e-12;     ///< balances worse than this get one step of iterative refinement, relative
  double identity_bound = 1e-9;  ///< a step whose balances are worse is not right
  double floor_bound = 1e-6;     ///< nor is one whose contact law can be evaluated no better than this
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
};

template <int d>
struct StepReport {
  Outcome outcome = Outcome::right;
  std::string reason;  ///< of an outcome that is not right, in words, where more can be said than its name
  Stage stage = Stage::none;
  int newton_iterations = 0;
  int open = 0, stick = 0, slip = 0;
  double max_penetration = 0;                     ///< length
  double normal_force = 0;                        ///< int p_nu, force
  Point<d> traction = Point<d>::Zero();           ///< int sigma nu over Gamma_C: the foundation's force on the body
  Point<d> friction_traction = Point<d>::Zero();  ///< its tangential part
  Ledger ledger{};
};

/// What a run costs, so far.
struct Cost {
  double setup_seconds = 0, step_seconds = 0;  ///< CPU of this process
  /// Parts of step_seconds: solves with their right-hand sides, the contact solver, the balances.
  double momentum_seconds = 0, contact_seconds = 0, heat_seconds = 0, books_seconds = 0;
  int steps = 0, refinements = 0, substitutions = 0, factorizations = 0, dense_factorizations = 0,
      newton_iterations = 0;
  double factor_bytes = 0;
};

template <int d>
class Stepper {
 public:
  /// Factors the operators of `problem` for the step size of `options`.
  Stepper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
          const ContactSurface<d>& surface, StepperOptions options);

  /// Sets the initial data (2.11); `gap` at the contact points. Fields the problem does not have are null. A run that
  /// goes on passes the contact forces and statuses of its last step as well: the next step is then the same to the
  /// last bit as that of a stepper that was told to `forget` there.
  void start(Vec u, Vec w, Vec theta, const Eigen::VectorXd& gap, double time = 0);
  void resume(const Eigen::VectorXd& contact_force, const std::vector<Status>& status);
  /// Drops what is remembered of earlier steps beside the state.
  void forget();
  /// One step. When the outcome is not `right`, the state is the last good one.
  StepReport<d> advance(const StepLoads& loads);

  const Level& level() const { return now_; }
  double time() const { return time_; }
  int steps() const { return cost_.steps; }
  const Eigen::VectorXd& contact_force() const { return contact_force_; }  ///< (d points), force on the foundation
  const std::vector<Status>& status() const { return status_; }
  const Cost& cost() const { return cost_; }
  Factor* momentum_factor() { return momentum_.get(); }  ///< nullptr without motion
  Factor* heat_factor() { return heat_.get(); }          ///< nullptr without heat and when monolithic
  std::string solver() const;

 private:
  StepReport<d> attempt(const StepLoads& loads);
  void momentum_right_side(const StepLoads& loads);
  Eigen::VectorXd reduce(Vec right);
  void heat_right_side(const StepLoads& loads, Vec heating_w, double scale);
  StepReport<d> conclude(const StepLoads& loads, const Ledger& ledger, ContactSolution<d>& contact);
  void products(Level& level) const;
  bool solve_contact(const StepLoads& loads, const Eigen::VectorXd& free, const Eigen::VectorXd& guess,
                     ContactSolution<d>& solution);
  void solve_heat(const StepLoads& loads, Vec heating_w);
  Ledger balance(const StepInputs& inputs);
  Outcome judge(const Ledger& ledger) const;
  std::string why(Outcome outcome, const Ledger& ledger) const;
  StepInputs complete(const StepLoads& loads, const ContactSolution<d>& contact);
  bool refine(const StepLoads& loads, const StepInputs& inputs, ContactSolution<d>& contact);
  void split(Vec coupled, Vec w, Vec theta) const;
  void join(Vec momentum, Vec heat, Vec coupled) const;
  static void fix(Vec v, const std::vector<PetscInt>& indices, Vec given, double scale = 1);
  bool monolithic() const { return options_.coupling == Coupling::monolithic && momentum_ && now_.theta; }
  bool reactive() const { return heat_ && surface_.points() > 0 && problem_.contact_heats(); }

  const Layout<d>& layout_;
  const Problem<d>& problem_;
  const Operators<d>& operators_;
  const ContactSurface<d>& surface_;
  StepperOptions options_;
  Bookkeeper<d> books_;
  double coupled_scale_ = 1;
  std::unique_ptr<Factor> momentum_, heat_;  // monolithic: momentum_ holds both fields
  std::unique_ptr<ContactSolver<d>> contact_;
  Level now_, next_;
  VecHandle momentum_right_, heat_right_, coupled_right_, coupled_, correction_w_, correction_theta_;
  std::vector<bool> fixed_contact_;  // of the contact nodes, those whose temperature is held
  Eigen::VectorXd free_;             // velocity of the contact points without contact force
  Eigen::VectorXd contact_force_;
  std::vector<Status> status_;
  double time_ = 0;
  Cost cost_;
};

}  // namespace warmslip
