// The contact law at one point, as values and pure functions: normal compliance (2.8) and Coulomb friction (2.9).
#pragma once
#include <algorithm>
#include <cstdint>

#include "warmslip/tensor.hpp"

namespace warmslip {

/// p_nu(r) = stiffness max(r, 0), the pressure on a penetration r = u_nu - g.
struct NormalCompliance {
  double stiffness;  ///< c_nu, stress per length

  double pressure(double r) const { return stiffness * std::max(r, 0.0); }
  double tangent(double r) const { return r > 0 ? stiffness : 0.0; }
  /// P with P' = p_nu and P(0) = 0, energy per area.
  double energy(double r) const { return 0.5 * stiffness * std::max(r, 0.0) * std::max(r, 0.0); }
};

/// p_tau(r) = coefficient p_nu(r), the friction bound.
struct CoulombFriction {
  double coefficient;  ///< mu_tau, dimensionless
};

struct ContactLaw {
  NormalCompliance compliance;
  CoulombFriction friction;

  double bound(double r) const { return friction.coefficient * compliance.pressure(r); }
};

enum class Status : std::int8_t { open, stick, slip };

/// What the law reads at one contact point of weight `weight` during one step of size `k`.
template <int d>
struct ContactPoint {
  Point<d> normal;        ///< outward unit normal of the body
  double weight;          ///< quadrature weight, area
  double penetration;     ///< r at the step's start with the gap of its end: u_{n-1}.nu - g_n
  Point<d> displacement;  ///< u_{n-1}, for the round-off floor of r alone
  double gap;             ///< g_n
};

/// Residual and generalised derivative of the law, written so that zero is the law itself (Alart & Curnier,
/// Comput. Methods Appl. Mech. Eng. 92, 1991): with force lambda and velocity w,
///   normal      alpha (lambda_nu - weight p_nu(r + k w_nu))
///   tangential  lambda_tau - proj_{|.| <= T}(lambda_tau + beta w_tau),   T = weight p_tau(r + k w_nu)
/// alpha (dimensionless) and beta (force per velocity) scale the rows; they do not move the zeros.
template <int d>
struct PointResidual {
  Point<d> value;
  Tensor2<d> by_force, by_velocity;
  Status status;
  int slip_sign;  ///< d = 2: sign of the slip along the tangent; the derivative depends on (status, slip_sign) alone
};

template <int d>
PointResidual<d> residual(const ContactLaw& law, const ContactPoint<d>& point, double k, double alpha, double beta,
                          const Point<d>& force, const Point<d>& velocity);

}  // namespace warmslip
