#include "warmslip/contact.hpp"

namespace warmslip {

template <int d>
PointResidual<d> residual(const ContactLaw& law, const ContactPoint<d>& point, double k, double alpha, double beta,
                          const Point<d>& force, const Point<d>& velocity) {
  const Point<d>& nu = point.normal;
  const Tensor2<d> normal = nu * nu.transpose();
  const Tensor2<d> tangential = Tensor2<d>::Identity() - normal;
  const double r = point.penetration + k * velocity.dot(nu);
  const double pressure_tangent = law.compliance.tangent(r);
  const double bound = point.weight * law.bound(r);

  PointResidual<d> out;
  out.value = alpha * (force.dot(nu) - point.weight * law.compliance.pressure(r)) * nu;
  out.by_force = alpha * normal;
  out.by_velocity = -alpha * point.weight * pressure_tangent * k * normal;
  out.slip_sign = 0;

  const Point<d> trial = tangential * (force + beta * velocity);
  const double size = trial.norm();
  if (r <= 0 || bound <= 0) {  // no pressure or no friction: the tangential force vanishes
    out.status = r <= 0 ? Status::open : Status::slip;
    out.value += tangential * force;
    out.by_force += tangential;
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
    out.by_velocity -=
        beta * turn + point.weight * law.friction.coefficient * pressure_tangent * k * direction * nu.transpose();
  }
  return out;
}

template PointResidual<2> residual<2>(const ContactLaw&, const ContactPoint<2>&, double, double, double,
                                      const Point<2>&, const Point<2>&);
template PointResidual<3> residual<3>(const ContactLaw&, const ContactPoint<3>&, double, double, double,
                                      const Point<3>&, const Point<3>&);

}  // namespace warmslip
