// The contact laws at one point, as values and pure functions: normal compliance (2.8), friction (2.9) and what the
// contact does to the heat.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

#include "warmslip/mesh/tensor.hpp"

namespace warmslip {

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// p_nu(r) = min(stiffness max(r, 0)^exponent, pressure_limit), the pressure on a penetration r = u_nu - g. An
/// unlimited stiffness is a rigid foundation: r <= 0, and any pressure at r = 0 (Signorini).
struct NormalCompliance {
  double stiffness = 0;               ///< c_nu, stress per length^exponent
  double exponent = 1;                ///< >= 1, dimensionless
  double pressure_limit = unlimited;  ///< stress
  /// A law of the user's in its place: pressure, derivative and energy (P' = p_nu, P(0) = 0) of r; p_nu(r) = 0 for r <=
  /// 0.
  std::function<std::array<double, 3>(double)> custom{};

  double pressure(double r) const;
  double tangent(double r) const;
  /// P with P' = p_nu and P(0) = 0, energy per area.
  double energy(double r) const;
  bool linear() const { return !custom && exponent == 1 && pressure_limit == unlimited; }
  bool rigid() const { return !custom && stiffness == unlimited; }
  /// The penetration under `pressure` > 0; `r` where the law does not tell (no pressure, the largest, a custom law).
  double penetration(double pressure, double r) const;
  /// Whether a pressure is the largest one, but for rounding.
  bool at_limit(double pressure) const { return pressure >= (1 - 1e-10) * pressure_limit; }
  /// The penetration from which on the pressure is the largest one; unlimited where there is none.
  double deepest_rise() const {
    return pressure_limit < unlimited ? std::pow(pressure_limit / stiffness, 1 / exponent) : unlimited;
  }
  /// s with s + give p_nu(s) = y: what is left of the penetration y > 0 at a point that recedes by `give` (length per
  /// stress) under pressure. Not for custom laws.
  double remaining(double y, double give) const;
};

/// Residual of the normal law at a point of weight `weight` with force lambda and penetration r, in units of force,
/// and its derivatives. With the resolvent of p_nu at the trial value lambda + r / give it reads
/// lambda - weight p_nu(s), s + give weight p_nu(s) = r + give lambda,
/// which vanishes on the law alone and is of order one in the force for every stiffness, an unlimited one included.
struct NormalResidual {
  double value, by_force, by_penetration;
  bool touching;  ///< the trial value is positive
};
NormalResidual normal_residual(const NormalCompliance& law, double weight, double give, double force, double r);

/// A friction bound and its derivatives.
struct FrictionBound {
  double value, by_pressure, by_speed;
};

/// |sigma_tau| <= min(cohesion + mu(|w_tau|) p_nu, limit): Coulomb's law, Tresca's (cohesion alone), both, or one that
/// is cut off. mu falls from `coefficient` at rest to `kinetic` at speeds far above `speed`.
struct Friction {
  double coefficient = 0;     ///< mu_tau, dimensionless
  double cohesion = 0;        ///< stress, borne without any pressure
  double limit = unlimited;   ///< stress
  double kinetic = 0;         ///< dimensionless; counts where speed > 0
  double speed = 0;           ///< velocity; 0: mu does not depend on it
  double regularisation = 0;  ///< velocity; > 0: the traction is bound w_tau / (|w_tau|^2 + regularisation^2)^(1/2)
  /// A law of the user's in its place: bound, derivatives by pressure and speed, of (pressure, speed).
  std::function<std::array<double, 3>(double, double)> custom{};

  FrictionBound bound(double pressure, double slip_speed) const;
  /// mu at a slip speed.
  double at(double slip_speed) const {
    return speed > 0 ? kinetic + (coefficient - kinetic) * std::exp(-slip_speed / speed) : coefficient;
  }
  /// Whether a traction may be borne at all.
  bool present() const { return custom || coefficient > 0 || cohesion > 0; }
  /// Whether the bound is a constant multiple of the pressure, or a constant.
  bool linear() const { return !custom && speed == 0 && limit == unlimited && regularisation == 0; }
};

struct ContactLaw {
  NormalCompliance compliance;
  Friction friction;

  /// Whether the generalised derivative depends on the statuses alone.
  bool piecewise_linear() const { return compliance.linear() && friction.linear(); }
};

/// Heat that the contact itself conducts and makes, beside a constant k_c: q . nu = per_pressure p_nu (theta - theta_F)
/// - share |sigma_tau . w_tau|.
struct ContactHeat {
  double per_pressure = 0;  ///< conductance per stress
  double share = 0;         ///< of the frictional heat, into the body; in [0, 1]

  bool present() const { return per_pressure > 0 || share > 0; }
};

enum class Status : std::int8_t { open, stick, slip };

/// What the law reads at one contact point of weight `weight` during one step of size `k`.
template <int d>
struct ContactPoint {
  Point<d> normal;          ///< outward unit normal of the body
  double weight;            ///< quadrature weight, area
  double penetration;       ///< r at the step's start with the gap of its end: u_{n-1}.nu - g_n
  Point<d> displacement;    ///< u_{n-1}, for the size of the terms of r alone
  double gap;               ///< g_n
  std::size_t law = 0;      ///< which of the problem's laws holds here
  bool prescribed = false;  ///< its motion is given, and its force sets no scale for others
};

/// A point's own compliance, which scales the rows of its residual and does not move their zeros.
struct PointCompliance {
  double normal;      ///< penetration per normal force, length per force
  double tangential;  ///< velocity per tangential force
};

/// Residual and generalised derivative of the law at one point, written so that zero is the law itself (Alart &
/// Curnier, Comput. Methods Appl. Mech. Eng. 92, 1991): with force lambda and velocity w,
///   normal      see NormalResidual
///   tangential  lambda_tau - proj_{|.| <= T}(lambda_tau + w_tau / c),   T = weight times the friction bound
/// The bound reads the pressure from the unknown force, max(lambda_nu, 0) / weight, and not from the penetration: an
/// iterate whose penetration no force has stopped yet would have far too large a bound. A bound that depends on the
/// speed is taken at the speed s with T(s) + s / c = |lambda_tau + w_tau / own|, its resolvent. Regularised friction
/// has lambda_tau - T w_tau / (|w_tau|^2 + eps^2)^(1/2) for its second row.
template <int d>
struct PointResidual {
  Point<d> value;
  Tensor2<d> by_force, by_velocity;
  Status status;
  int slip_sign;  ///< d = 2: sign of the slip along the tangent
  bool touching;  ///< see NormalResidual
  bool pressed;   ///< lambda_nu > 0
  bool away;      ///< no pressure acts: the normal residual is the normal force
  bool smooth;    ///< no friction acts: the tangential residual is the tangential force

  /// Of a piecewise linear law the derivative (d = 2) depends on this alone.
  int key() const {
    return (smooth ? 100000 : 0) + (away ? 10000 : 0) + (pressed ? 1000 : 0) + (touching ? 100 : 0) +
           static_cast<int>(status) * 10 + slip_sign;
  }
};

template <int d>
PointResidual<d> residual(const ContactLaw& law, const ContactPoint<d>& point, double k,
                          const PointCompliance& compliance, const Point<d>& force, const Point<d>& velocity);

/// The velocity of a closed point as the law has it: at rest where it sticks, and as deep as its force says. What
/// momentum leaves of the velocity `free` without contact force is `velocity`, known but for rounding of `free`: far
/// more than the whole velocity, on a stiff foundation. A component that the law knows no better is that of `velocity`.
template <int d>
Point<d> settled(const ContactLaw& law, const ContactPoint<d>& point, double k, Status status, const Point<d>& force,
                 const Point<d>& free, const Point<d>& velocity);

/// How far a tangential force and a slip velocity are from the friction law at one point whose bound is `bound`
/// (force): the least change of the force, over `forces`, or of the velocity, over `velocities`, after which the law
/// holds.
template <int d>
double friction_defect(const Friction& friction, double bound, const Point<d>& force, const Point<d>& slip_velocity,
                       double forces, double velocities);

/// Power that friction takes from the body: bound |w_tau|, or what the regularised law leaves of it.
double friction_power(const Friction& friction, double bound, double slip_speed);

}  // namespace warmslip
