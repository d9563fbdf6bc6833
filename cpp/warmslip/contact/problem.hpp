// The contact problem of one time step in the contact unknowns alone, and its solution. Eigen only, no PETSc, no MPI.
#pragma once
#include <cstdint>
#include <vector>

#include "warmslip/physics/contact_law.hpp"

namespace warmslip {

struct ContactOptions {
  double tolerance = 1e-12;  ///< on the residual of the contact law, relative
  int newton_steps = 40;
  int fixed_point_steps = 200;
  int enumerate_points = 6;  ///< enumerate the statuses of at most so many points (d = 2)
  double proximal = 0;       ///< > 0 where contact points outnumber contact nodes; dimensionless
};

/// Which safeguard produced the answer.
enum class Stage : std::int8_t { none, newton, restart, tresca_fixed_point, enumeration };

template <int d>
struct ContactProblem {
  std::vector<ContactLaw> laws;
  double step;  ///< k, time
  std::vector<ContactPoint<d>> points;
  Eigen::VectorXd free;     ///< (d points), velocity without contact force
  Eigen::VectorXd rigid{};  ///< (motions), load on the rigid motions that are solved for apart, see RigidCoupling
  /// (d points), a force and the velocities under it, `rigid` being what it leaves of that load: forces near it then
  /// have velocities without rounding of the free ones. Both empty where nothing is known.
  Eigen::VectorXd known_force{}, known_velocity{};

  const ContactLaw& law(std::size_t point) const { return laws[points[point].law]; }
};

/// Rigid motions that the compliance leaves out: with their velocities a, the points move at
/// free - C lambda + motions a, and the load on them is balanced by loads^T lambda + inertia a.
struct RigidCoupling {
  Eigen::MatrixXd motions;  ///< (d points, motions), dimensionless
  Eigen::MatrixXd loads;    ///< likewise; `motions` unless the operator is not symmetric
  Eigen::MatrixXd inertia;  ///< (motions, motions), force per velocity

  Eigen::Index count() const { return inertia.rows(); }
};

template <int d>
struct ContactSolution {
  Eigen::VectorXd force, velocity;  ///< (d points)
  Eigen::VectorXd added;            ///< (d points), force less the known one, without rounding of the force
  Eigen::VectorXd rigid;            ///< (motions), velocity
  std::vector<Status> status;
  bool converged = false;
  bool unsupported = false;   ///< nothing determines a rigid motion, and no solution was found
  bool undetermined = false;  ///< nor does anything in the solution that was found: there are others
  Stage stage = Stage::none;
  int iterations = 0;       ///< Newton steps of all stages
  int factorizations = 0;   ///< of the dense tangent
  double law_residual = 0;  ///< of the contact law, a backward error; accepted up to the tolerance
};

}  // namespace warmslip
