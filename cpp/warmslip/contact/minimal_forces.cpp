#include "warmslip/contact/minimal_forces.hpp"

#include <algorithm>
#include <limits>

namespace warmslip {
namespace {

using Shape = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// A point that shares its force with others. At rest it shares its friction, up to the bound; on a rigid foundation
// also its pressure, of which the bound may be a multiple. A point that slips there shares pressure, and its friction
// follows; in space each has a direction of its own, and points that slip with friction keep the forces they have.
template <int d>
struct Sharing {
  Eigen::Index point;
  double weight;
  double bound;        // force: of the friction, at no pressure where that is shared
  double coefficient;  // friction per shared pressure
  bool rests, pressed;
  Point<d> normal, drag = Point<d>::Zero();  // the latter: friction over its bound, of a point that slips

  struct Projection {
    Point<d> force;
    Tensor2<d> derivative;
  };
  // The force, of those that it may have, that is nearest to one, and how it follows that one.
  Projection nearest(const Point<d>& to) const {
    if (!rests) {
      const Point<d> edge = normal + coefficient * drag, least = bound * drag;
      const double p = (to - least).dot(edge) / edge.squaredNorm();
      return {least + std::max(p, 0.0) * edge, (p >= 0 ? 1 / edge.squaredNorm() : 0.0) * edge * edge.transpose()};
    }
    const Tensor2<d> across = normal * normal.transpose(), tangential = Tensor2<d>::Identity() - across;
    const Point<d> t = tangential * to;
    const double p = pressed ? to.dot(normal) : 0, size = t.norm();
    if (size <= bound + coefficient * std::max(p, 0.0))
      return {t + std::max(p, 0.0) * normal, tangential + (p >= 0 ? 1.0 : 0.0) * across};
    const Point<d> way = t / size, edge = normal + coefficient * way;  // on the edge of the cone, or at its tip
    const double pressure = pressed ? std::max((p + coefficient * (size - bound)) / edge.squaredNorm(), 0.0) : 0,
                 friction = bound + coefficient * pressure;
    return {pressure * normal + friction * way,
            friction / size * (tangential - way * way.transpose()) +
                (pressure > 0 ? 1 / edge.squaredNorm() : 0.0) * edge * edge.transpose()};
  }
  // What it shares of a force.
  Point<d> part(const Point<d>& force) const { return pressed ? force : Point<d>(force - force.dot(normal) * normal); }
};

template <int d>
std::vector<Sharing<d>> sharing(const ContactProblem<d>& problem, const ContactSolution<d>& solution,
                                double tolerance) {
  double max_speed = 0, reach = 0, largest = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> free = problem.free.template segment<d>(row), w = solution.velocity.template segment<d>(row);
    max_speed = std::max({max_speed, free.norm(), w.norm()});
    largest = std::max(largest, solution.force.template segment<d>(row).norm());
    reach = std::max(reach, point.displacement.norm() + std::abs(point.gap) + problem.step * (free.norm() + w.norm()));
  }
  std::vector<Sharing<d>> out;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const Friction& friction = law.friction;
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> w = solution.velocity.template segment<d>(row), force = solution.force.template segment<d>(row);
    const Point<d> slip = w - w.dot(point.normal) * point.normal, rub = force - force.dot(point.normal) * point.normal;
    const double speed = slip.norm(), pressure = std::max(force.dot(point.normal), 0.0) / point.weight;
    const double least = point.weight * friction.bound(0, speed).value,
                 bound = point.weight * friction.bound(pressure, speed).value;
    // the power that will be missing is at most twice bound times speed
    const bool rests = friction.regularisation == 0 && bound > 0 && speed <= tolerance * max_speed;
    const double r = point.penetration + problem.step * w.dot(point.normal);
    const bool pressed = law.compliance.rigid() && !point.prescribed && std::abs(r) <= tolerance * reach &&
                         !friction.custom && friction.limit == unlimited && (rests || d == 2 || bound == 0);
    if (!rests && !pressed) continue;
    Sharing<d> one{static_cast<Eigen::Index>(i), point.weight, bound, 0, rests, pressed, point.normal};
    if (pressed) {
      one.bound = least;
      one.coefficient = friction.bound(1, speed).value - friction.bound(0, speed).value;
    }
    if (!rests) {
      if (bound > 1e-6 * largest)
        one.drag = rub / bound;
      else if (speed > 0)
        one.drag = slip / std::hypot(speed, friction.regularisation);
    }
    out.push_back(one);
  }
  return out;
}

// The dual problem: forces lambda_q nearest to weight y(q) with nodal y minimise the convex function whose gradient is
// what they put on the nodes less what is asked for.
template <int d>
struct Dual {
  const std::vector<Sharing<d>>& points;
  const Shape& shape;
  const Eigen::VectorXd& asked;  // (d nodes)

  Point<d> at(const Sharing<d>& q, const Eigen::VectorXd& y) const {
    return q.weight * (shape.middleRows(q.point * d, d) * y);
  }
  Eigen::VectorXd gradient(const Eigen::VectorXd& y) const {
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(shape.rows());
    for (const auto& q : points) forces.template segment<d>(q.point * d) = q.nearest(at(q, y)).force;
    return shape.transpose() * forces - asked;
  }
  // its generalised derivative, with something on the diagonal
  Eigen::SparseMatrix<double> curvature(const Eigen::VectorXd& y, double damping) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& q : points) {
      const Tensor2<d> own = q.weight * q.nearest(at(q, y)).derivative;
      for (int a = 0; a < d; ++a)
        for (int b = 0; b < d; ++b)
          for (Shape::InnerIterator i(shape, q.point * d + a); i; ++i)
            for (Shape::InnerIterator j(shape, q.point * d + b); j; ++j)
              entries.emplace_back(i.col(), j.col(), i.value() * j.value() * own(a, b));
    }
    for (Eigen::Index i = 0; i < asked.size(); ++i) entries.emplace_back(i, i, damping);
    Eigen::SparseMatrix<double> out(asked.size(), asked.size());
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }
};

}  // namespace

template <int d>
bool minimal_forces(const ContactProblem<d>& problem, const Shape& shape, double tolerance,
                    ContactSolution<d>& solution) {
  const std::vector<Sharing<d>> points = sharing(problem, solution, tolerance);
  if (points.empty()) return true;
  for (const auto& q : points)
    if (q.rests) solution.status[static_cast<std::size_t>(q.point)] = Status::stick;
  Eigen::VectorXd shared = Eigen::VectorXd::Zero(shape.rows());
  double max_bound = 0;
  for (const auto& q : points) {
    const Point<d> part = q.part(solution.force.template segment<d>(q.point * d));
    shared.template segment<d>(q.point * d) = part;
    max_bound = std::max({max_bound, q.bound, part.norm()});
  }
  const Eigen::VectorXd asked = shape.transpose() * shared;
  const Dual<d> dual{points, shape, asked};
  double heaviest = 0;
  for (const auto& q : points) heaviest = std::max(heaviest, q.weight);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(asked.size()), gradient = dual.gradient(y);
  const double enough = 8 * std::numeric_limits<double>::epsilon() * max_bound, least = 1e-12 * heaviest;
  double damping = least;  // where nothing rests, or forces are at their bounds, the function is flat
  for (int step = 0; step < 500 && gradient.cwiseAbs().maxCoeff() > enough; ++step) {
    const Eigen::VectorXd change =
        -Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(dual.curvature(y, damping)).solve(gradient);
    const Eigen::VectorXd next = dual.gradient(y + change);
    const double promised = 0.5 * (damping * change.squaredNorm() - gradient.dot(change)),
                 gained = -0.5 * (gradient + next).dot(change);  // by the trapezoidal rule, without cancellation
    if (gained < 0.25 * promised) damping *= 8;
    if (gained > 0.75 * promised) damping = std::max(least, damping / 8);
    if (!(gained > 1e-4 * promised)) continue;
    y += change;
    gradient = next;
  }
  if (!(gradient.cwiseAbs().maxCoeff() <= 0.5 * tolerance * max_bound)) return false;
  for (const auto& q : points) {
    auto force = solution.force.template segment<d>(q.point * d);
    const Point<d> change = q.nearest(dual.at(q, y)).force - q.part(force);
    force += change;
    solution.added.template segment<d>(q.point * d) += change;
  }
  return true;
}

template bool minimal_forces<2>(const ContactProblem<2>&, const Shape&, double, ContactSolution<2>&);
template bool minimal_forces<3>(const ContactProblem<3>&, const Shape&, double, ContactSolution<3>&);

}  // namespace warmslip
