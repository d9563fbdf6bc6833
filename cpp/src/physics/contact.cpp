#include "warmslip/contact.hpp"

namespace warmslip {

double NormalCompliance::pressure(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[0];
  return std::min(exponent == 1 ? stiffness * r : stiffness * std::pow(r, exponent), most);
}

double NormalCompliance::tangent(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[1];
  if (exponent == 1) return stiffness * r < most ? stiffness : 0;
  const double slope = stiffness * exponent * std::pow(r, exponent - 1);
  return slope * r / exponent < most ? slope : 0;
}

double NormalCompliance::energy(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[2];
  if (linear()) return 0.5 * stiffness * r * r;
  const double full =
      stiffness > 0 ? std::pow(most / stiffness, 1 / exponent) : r;  // penetration of the largest pressure
  const double bent = std::min(r, full);
  return stiffness * std::pow(bent, exponent + 1) / (exponent + 1) + (r > full ? most * (r - full) : 0);
}

FrictionBound Friction::bound(double pressure, double slip_speed) const {
  if (custom) {
    const auto [value, by_pressure, by_speed] = custom(pressure, slip_speed);
    return {value, by_pressure, by_speed};
  }
  const double fall = speed > 0 ? (coefficient - kinetic) * std::exp(-slip_speed / speed) : 0;
  const double mu = speed > 0 ? kinetic + fall : coefficient;
  const double value = cohesion + mu * pressure;
  if (value >= limit) return {limit, 0, 0};
  return {value, mu, speed > 0 ? -fall / speed * pressure : 0};
}

template <int d>
PointResidual<d> residual(const ContactLaw& law, const ContactPoint<d>& point, double k, double alpha, double beta,
                          const Point<d>& force, const Point<d>& velocity) {
  const Point<d>& nu = point.normal;
  const Tensor2<d> normal = nu * nu.transpose();
  const Tensor2<d> tangential = Tensor2<d>::Identity() - normal;
  const double r = point.penetration + k * velocity.dot(nu);
  const double pressure_tangent = law.compliance.tangent(r);
  const Point<d> slip = tangential * velocity;
  const FrictionBound friction = law.bound(r, slip.norm());
  const double bound = point.weight * friction.value;
  // derivative of the bound by the velocity
  Point<d> widening = point.weight * friction.by_pressure * pressure_tangent * k * nu;
  if (friction.by_speed != 0 && slip.norm() > 0) widening += point.weight * friction.by_speed * slip.normalized();

  PointResidual<d> out;
  out.touching = r > 0;
  out.value = alpha * (force.dot(nu) - point.weight * law.compliance.pressure(r)) * nu;
  out.by_force = alpha * normal;
  out.by_velocity = -alpha * point.weight * pressure_tangent * k * normal;
  out.slip_sign = 0;

  const Point<d> trial = tangential * (force + beta * velocity);
  const double size = trial.norm();
  if (bound <= 0) {  // no pressure or no friction: the tangential force vanishes
    out.status = r <= 0 ? Status::open : Status::slip;
    out.value += tangential * force;
    out.by_force += tangential;
  } else if (law.friction.regularisation > 0) {
    const double eps = law.friction.regularisation, blunt = std::hypot(slip.norm(), eps);
    out.status = slip.norm() < eps ? Status::stick : Status::slip;
    out.value += tangential * force - bound / blunt * slip;
    out.by_force += tangential;
    out.by_velocity -=
        bound / blunt * (tangential - slip * slip.transpose() / (blunt * blunt)) + slip / blunt * widening.transpose();
  } else if (size <= bound) {
    out.status = Status::stick;
    out.value -= beta * (tangential * velocity);
    out.by_velocity -= beta * tangential;
  } else {
    out.status = Status::slip;
    const Point<d> direction = trial / size;
    for (int a = 0; a < d && out.slip_sign == 0; ++a)
      if (std::abs(direction[a]) > 0.5) out.slip_sign = direction[a] > 0 ? a + 1 : -(a + 1);
    // the direction turns only for d = 3
    const Tensor2<d> turn = d == 2 ? Tensor2<d>(Tensor2<d>::Zero())
                                   : Tensor2<d>(bound / size * (tangential - direction * direction.transpose()));
    out.value += tangential * force - bound * direction;
    out.by_force += tangential - turn;
    out.by_velocity -= beta * turn + direction * widening.transpose();
  }
  return out;
}

template <int d>
FrictionDefect friction_defect(const Friction& friction, double bound, const Point<d>& force,
                               const Point<d>& slip_velocity) {
  if (friction.regularisation > 0) {
    const double blunt = std::hypot(slip_velocity.norm(), friction.regularisation);
    return {(force - bound / blunt * slip_velocity).norm(), 0};
  }
  return {force.norm() - bound, bound * slip_velocity.norm() - force.dot(slip_velocity)};
}

double friction_power(const Friction& friction, double bound, double slip_speed) {
  if (friction.regularisation > 0)
    return bound * slip_speed * slip_speed / std::hypot(slip_speed, friction.regularisation);
  return bound * slip_speed;
}

#define WARMSLIP_INSTANTIATE(d)                                                                            \
  template PointResidual<d> residual<d>(const ContactLaw&, const ContactPoint<d>&, double, double, double, \
                                        const Point<d>&, const Point<d>&);                                 \
  template FrictionDefect friction_defect<d>(const Friction&, double, const Point<d>&, const Point<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
