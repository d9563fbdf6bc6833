// The linear systems of a step, factored for one step size, and the contact solver that knows their compliance.
#pragma once
#include <vector>

#include "warmslip/contact/solver.hpp"
#include "warmslip/fem/contact_surface.hpp"
#include "warmslip/fem/operators.hpp"
#include "warmslip/fem/rigid_motions.hpp"
#include "warmslip/la/factor.hpp"

namespace warmslip {

/// Which time level the coupling terms take: (theta_{n-1}, w_n), (theta_{n-1}, w_{n-1}) or (theta_n, w_n).
enum class Coupling { staggered, lagged, monolithic };

template <int d>
struct StepSystems {
  /// Factors the operators for steps of size `k` (collective). Throws std::invalid_argument where that is impossible.
  StepSystems(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
              const ContactSurface<d>& surface, double k, Coupling coupling, Backend backend,
              ContactOptions contact_options);

  double k;                                ///< step size, time
  double coupled_scale = 1;                ///< of the heat rows in the coupled operator
  Eigen::VectorXd support_scales;          ///< of the inclined nodes in the operator of the motion
  std::unique_ptr<Factor> momentum, heat;  ///< null where absent; monolithic: `momentum` holds both fields
  RigidMotions rigid, constants;           ///< of motion and of heat, where nothing is prescribed
  bool sprung = false;                     ///< whether springs or dashpots resist the rigid motions
  std::unique_ptr<ContactSolver<d>> contact;
  Eigen::MatrixXd carried;  ///< velocities of the contact points in the rigid motions

  /// y += (k S + D) x with springs S and dashpots D.
  static void add_springs(const Operators<d>& operators, double k, Vec x, Vec y);

  int factorizations() const { return (momentum ? 1 : 0) + (heat ? 1 : 0); }
  int substitutions() const;
  double bytes() const;  ///< of the factors, on this rank
  double flops() const;  ///< of the factorizations on this rank, 0 where unknown

 private:
  void factor_motion(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                     const ContactSurface<d>& surface, Mat a, int width, Symmetry symmetry, const std::string& name,
                     Backend backend);
};

/// The systems of several step sizes. Those that were used last are kept while their factors take no more than a
/// bound. Steppers of one set of operators may share them, one after the other.
template <int d>
class SystemCache {
 public:
  /// `bytes`: bound on the factors of all ranks together; the systems in use are kept whatever they take.
  SystemCache(const Layout<d>& layout, double bytes) : layout_(layout), bound_(bytes) {}

  /// The systems for a step size, null where they are not kept.
  std::shared_ptr<StepSystems<d>> find(double k);
  /// Keeps new systems and drops those that were not used for longest (collective).
  void keep(std::shared_ptr<StepSystems<d>> systems);
  void clear_contact_caches();
  double bytes() const;  ///< of all factors that are kept, on this rank

 private:
  const Layout<d>& layout_;
  double bound_;
  std::vector<std::shared_ptr<StepSystems<d>>> kept_;  // the one used last comes last
};

}  // namespace warmslip
