#include "warmslip/physics/contact_law.hpp"

namespace warmslip {

double NormalCompliance::pressure(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[0];
  return std::min(exponent == 1 ? stiffness * r : stiffness * std::pow(r, exponent), pressure_limit);
}

double NormalCompliance::tangent(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[1];
  if (exponent == 1) return rigid() || stiffness * r < pressure_limit ? stiffness : 0;
  const double slope = stiffness * exponent * std::pow(r, exponent - 1);
  return slope * r / exponent < pressure_limit ? slope : 0;
}

double NormalCompliance::energy(double r) const {
  if (r <= 0) return 0;
  if (custom) return custom(r)[2];
  if (rigid()) return 0;  // it stores nothing
  if (linear()) return 0.5 * stiffness * r * r;
  const double full =
      stiffness > 0 ? std::pow(pressure_limit / stiffness, 1 / exponent) : r;  // penetration of the largest pressure
  const double rising = std::min(r, full);
  return stiffness * std::pow(rising, exponent + 1) / (exponent + 1) + (r > full ? pressure_limit * (r - full) : 0);
}

FrictionBound Friction::bound(double pressure, double slip_speed) const {
  if (custom) {
    const auto [value, by_pressure, by_speed] = custom(pressure, slip_speed);
    return {value, by_pressure, by_speed};
  }
  const double mu = at(slip_speed), fall = mu - kinetic;
  const double value = cohesion + mu * pressure;
  if (value >= limit) return {limit, 0, 0};
  return {value, mu, speed > 0 ? -fall / speed * pressure : 0};
}

double NormalCompliance::penetration(double pressure, double r) const {
  if (custom || pressure <= 0 || at_limit(pressure) || stiffness == 0) return r;
  return exponent == 1 ? pressure / stiffness : std::pow(pressure / stiffness, 1 / exponent);
}

double NormalCompliance::remaining(double y, double give) const {
  if (linear()) return y / (1 + give * stiffness);
  if (pressure_limit < unlimited && y - give * pressure_limit >= deepest_rise()) return y - give * pressure_limit;
  // convex and rising: from the right, Newton's method falls to the root
  double s = stiffness > 0 && give > 0 ? std::min(y, std::pow(y / (give * stiffness), 1 / exponent)) : y;
  for (int i = 0; i < 60; ++i) {
    const double p = stiffness * std::pow(s, exponent), slope = 1 + give * exponent * (s > 0 ? p / s : 0);
    const double next = s - (s + give * p - y) / slope;
    if (!(next < s) || next <= 0) break;
    s = next;
  }
  return s;
}

NormalResidual normal_residual(const NormalCompliance& law, double weight, double give, double force, double r) {
  if (law.custom) {  // known at penetrations that occur, and not between them
    const double slope = weight * law.tangent(r), scale = 1 / (1 + give * slope);
    return {force - weight * law.pressure(r), 1, -slope, std::isfinite(scale) && r > 0};
  }
  const double y = r + give * force;
  if (!(y > 0)) return {force, 1, 0, false};
  if (law.linear()) {
    const double stiff = weight * law.stiffness * give;  // of the foundation over the body
    if (stiff < 1)
      return {(force - weight * law.stiffness * r) / (1 + stiff), 1 / (1 + stiff),
              -weight * law.stiffness / (1 + stiff), true};
    const double soft = 1 / stiff;
    return {(soft * force - r / give) / (1 + soft), soft / (1 + soft), -1 / (give * (1 + soft)), true};
  }
  const double s = law.remaining(y, weight * give), slope = weight * law.tangent(s), stiff = slope * give;
  const double value = stiff < 1 ? force - weight * law.pressure(s) : (s - r) / give;
  return {value, 1 / (1 + stiff), -slope / (1 + stiff), true};
}

namespace {

// The tangential force at a slip speed, and its derivatives: the bound, or what regularised friction leaves of it.
FrictionBound traction(const Friction& law, double pressure, double weight, double speed) {
  const FrictionBound bound = law.bound(pressure, speed);
  if (law.regularisation == 0) return {weight * bound.value, weight * bound.by_pressure, weight * bound.by_speed};
  const double smoothed_speed = std::hypot(speed, law.regularisation), part = speed / smoothed_speed,
               rise = law.regularisation / smoothed_speed / smoothed_speed * law.regularisation / smoothed_speed;
  return {weight * bound.value * part, weight * bound.by_pressure * part,
          weight * (bound.by_speed * part + bound.value * rise)};
}

// The traction at the slip speed s >= 0 with traction(s) + beta s = trial: its resolvent. The least such speed is taken
// where the traction falls faster than beta.
FrictionBound slipping(const Friction& law, double pressure, double weight, double beta, double trial) {
  double low = 0, high = trial / beta, s = law.regularisation > 0 ? high : 0;
  FrictionBound at{};
  for (int i = 0; i < 200; ++i) {
    at = traction(law, pressure, weight, s);
    const double excess = at.value + beta * s - trial;
    if (std::abs(excess) <= 4 * std::numeric_limits<double>::epsilon() * trial) break;
    (excess > 0 ? high : low) = s;
    const double next = s - excess / (at.by_speed + beta);
    // halved on a logarithmic scale: small speeds matter where friction is regularised
    s = next > low && next < high ? next : low > 0 ? std::sqrt(low) * std::sqrt(high) : 1e-3 * high;
    if (law.regularisation == 0 && !(next > low && next < high)) s = 0.5 * (low + high);
    if (!(high - low > 1e-15 * high)) break;
  }
  return at;
}

}  // namespace

template <int d>
PointResidual<d> residual(const ContactLaw& law, const ContactPoint<d>& point, double k,
                          const PointCompliance& compliance, const Point<d>& force, const Point<d>& velocity) {
  const Point<d>& nu = point.normal;
  const Tensor2<d> normal = nu * nu.transpose();
  const Tensor2<d> tangential = Tensor2<d>::Identity() - normal;
  // what rounding of a large vector leaves along the normal is no part of a small one across it
  const auto across_normal = [&](const Point<d>& v) -> Point<d> { return tangential * (tangential * v).eval(); };
  const double r = point.penetration + k * velocity.dot(nu), lambda = force.dot(nu), beta = 1 / compliance.tangential;
  const NormalResidual across = normal_residual(law.compliance, point.weight, compliance.normal, lambda, r);
  const Point<d> slip = tangential * velocity;
  const double speed = slip.norm(), pressure = std::max(lambda, 0.0) / point.weight;
  const bool smooth = law.friction.regularisation > 0;
  FrictionBound friction = law.friction.bound(pressure, 0);
  double bound = point.weight * friction.value;

  PointResidual<d> out;
  out.touching = across.touching;
  out.pressed = lambda > 0;
  out.away = !out.touching && across.by_force == 1 && across.by_penetration == 0;
  out.smooth = false;
  out.value = across.value * nu;
  out.by_force = across.by_force * normal;
  out.by_velocity = k * across.by_penetration * normal;
  out.slip_sign = 0;

  const Point<d> trial = tangential * (force + beta * velocity);
  const double size = trial.norm();
  if (bound <= 0 || (!out.touching && law.friction.cohesion <= 0 && !law.friction.custom)) {  // no friction
    out.status = out.touching ? Status::slip : Status::open;
    out.smooth = true;
    out.value += across_normal(force);
    out.by_force += tangential;
  } else if (!smooth && size <= bound) {
    out.status = Status::stick;
    out.value -= beta * slip;
    out.by_velocity -= beta * tangential;
  } else {
    out.status = smooth && speed < law.friction.regularisation ? Status::stick : Status::slip;
    friction.by_pressure *= point.weight;
    friction.by_speed = 0;
    if (law.friction.custom || law.friction.speed > 0 || smooth) {
      friction = slipping(law.friction, pressure, point.weight, beta, size);
      bound = friction.value;
    }
    const Point<d> direction = size > 0 ? Point<d>(trial / size) : Point<d>(Point<d>::Zero());
    // how the traction follows the trial force, and the pressure
    const double follows = friction.by_speed / (friction.by_speed + beta);
    const Point<d> widening = (1 - follows) * (lambda > 0 ? friction.by_pressure / point.weight : 0.0) * nu;
    for (int a = 0; a < d && out.slip_sign == 0; ++a)
      if (std::abs(direction[a]) > 0.5) out.slip_sign = direction[a] > 0 ? a + 1 : -(a + 1);
    // the direction turns only for d = 3
    Tensor2<d> turn = follows * (direction * direction.transpose());
    const double turns = size > 0 ? bound / size : follows;
    if (d == 3 || size == 0) turn += turns * (tangential - direction * direction.transpose());
    out.value += across_normal(tangential * force - bound * direction);
    out.by_force += tangential - turn - direction * widening.transpose();
    out.by_velocity -= beta * turn;
  }
  return out;
}

template <int d>
Point<d> settled(const ContactLaw& law, const ContactPoint<d>& point, double k, Status status, const Point<d>& force,
                 const Point<d>& free, const Point<d>& velocity) {
  const Point<d>& nu = point.normal;
  const auto along = [&](const Point<d>& v) { return v.cwiseAbs().dot(nu.cwiseAbs()); };
  const double pressure = force.dot(nu) / point.weight,
               size = along(point.displacement) + std::abs(point.gap) + k * along(velocity);
  double across = velocity.dot(nu);
  Point<d> slip = velocity - across * nu;
  const bool rests = law.friction.regularisation == 0 && slip.norm() <= 1e-9 * free.norm();
  if (status == Status::stick && rests) slip.setZero();
  if (pressure > 0 && size <= 1e-3 * k * along(free) && !law.compliance.custom && !law.compliance.at_limit(pressure))
    across = (law.compliance.penetration(pressure, 0) - point.penetration) / k;
  return across * nu + slip;
}

template <int d>
double friction_defect(const Friction& friction, double bound, const Point<d>& force, const Point<d>& slip_velocity,
                       double forces, double velocities) {
  const double speed = slip_velocity.norm();
  const double smeared = std::hypot(speed, friction.regularisation);
  const double slips =
      smeared > 0 ? (force - bound / smeared * slip_velocity).norm() : std::max(force.norm() - bound, 0.0);
  if (slips == 0) return 0;
  if (friction.regularisation > 0) {  // the force may be wrong, or the velocity that it belongs to
    const double size = force.norm();
    if (size >= bound) return slips / forces;
    const double part = size / bound, belongs = friction.regularisation / std::sqrt((1 - part) * (1 + part)) / bound;
    return std::min(slips / forces, (slip_velocity - belongs * force).norm() / velocities);
  }
  if (speed == 0) return slips / forces;
  const double size = force.norm(), beyond = std::max(size - bound, 0.0) / forces;
  const double sticks = std::max(beyond, speed / velocities);
  if (size == 0) return std::min(slips / forces, sticks);
  const Point<d> along = force / size;  // slips the way its force points
  const double across = (slip_velocity - std::max(slip_velocity.dot(along), 0.0) * along).norm();
  return std::min({slips / forces, sticks, std::max(std::abs(size - bound) / forces, across / velocities)});
}

double friction_power(const Friction& friction, double bound, double slip_speed) {
  if (friction.regularisation > 0)
    return bound * slip_speed * slip_speed / std::hypot(slip_speed, friction.regularisation);
  return bound * slip_speed;
}

#define WARMSLIP_INSTANTIATE(d)                                                                                    \
  template PointResidual<d> residual<d>(const ContactLaw&, const ContactPoint<d>&, double, const PointCompliance&, \
                                        const Point<d>&, const Point<d>&);                                         \
  template Point<d> settled<d>(const ContactLaw&, const ContactPoint<d>&, double, Status, const Point<d>&,         \
                               const Point<d>&, const Point<d>&);                                                  \
  template double friction_defect<d>(const Friction&, double, const Point<d>&, const Point<d>&, double, double);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
