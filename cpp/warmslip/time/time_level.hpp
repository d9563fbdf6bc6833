// What a step starts from, what it is given and what its balances find: values.
#pragma once
#include "warmslip/fem/contact_surface.hpp"
#include "warmslip/fem/operators.hpp"

namespace warmslip {

/// What the balances read of one time level; what belongs to an absent block is null or empty.
struct TimeLevel {
  VecHandle u, w, theta;                      ///< displacement, velocity, temperature
  VecHandle strained, strained_w;             ///< u and w but for rigid motions, where the body has no support
  Eigen::VectorXd rigid;                      ///< and the velocities of the rigid motion that w has besides
  VecHandle momentum, elastic_u, mass_theta;  ///< rho M w, A u, M theta
  VecHandle sprung;                           ///< S u of springs that resist a rigid motion
  VecHandle expansion_theta, heating_w;       ///< G theta, E w
  Eigen::VectorXd contact_u, gap;             ///< u at the contact points (d points), g (points)
  Eigen::VectorXd contact_force;              ///< lambda of the step that ends here (d points)

  struct {
    double u = 0, w = 0, straining = 0, theta = 0;
  } sizes;                                          ///< largest entries, of u the part that inner forces see
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();  ///< largest entries of u, by axis

  /// The displacement and the velocity that inner forces see.
  Vec shape() const { return strained ? strained : u; }
  Vec straining() const { return strained_w ? strained_w : w; }
};

/// Terms of one step in energy (d = 2: per length), as they stand in the balance; each dissipation is >= 0. Those of
/// absent blocks are zero.
struct Balances {
  double kinetic, elastic, contact;  ///< stored at the end of the step
  double kinetic_change, elastic_change, contact_change;
  double inertia_damping, elastic_damping, contact_damping;  ///< backward Euler's own dissipation
  double viscous, friction;
  double load_work, expansion_work, gap_work, support_work;  ///< the last: of the reactions of moving supports
  double foundation_work;                                    ///< of the friction of a foundation that moves along
  /// the same balance for theta; `support_heat`: of parts with a prescribed temperature
  double heat_change, heat_damping, conducted, exchanged, supplied, heating, friction_heating, support_heat;
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
  Eigen::VectorXd contact_free;       ///< velocity without contact, as below, for the size of its terms
  Eigen::VectorXd foundation;         ///< theta_F at the points, where the conductance depends on the pressure
  Eigen::VectorXd drive;              ///< tangential velocity of the foundation, to which slip is relative, (d points)
  Vec support_velocity;               ///< of the held directions, null where all are at rest
  /// By axis: a displacement that the rounding of those of the body may make.
  Eigen::Vector3d least_motion = Eigen::Vector3d::Zero();
};

}  // namespace warmslip
