#include "warmslip/contact_share.hpp"

#include <algorithm>
#include <limits>

namespace warmslip {
namespace {

using Shape = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// A point that shares its force with others, and the forces that its law allows at the velocity it has. On a rigid
// foundation they are the cone of all pressures with their friction: while the point rests with any up to the bound,
// while it slips with just that. Elsewhere the penetration gives the pressure, and a resting point shares its friction.
template <int d>
struct Sharing {
  Eigen::Index point;
  double weight;
  double cohesion;     // force: friction without pressure, or the whole bound where the pressure is given
  double coefficient;  // friction per pressure
  bool pressed;        // shares its pressure as well
  bool slips;
  Point<d> normal, along;  // along: where its friction points while it slips

  struct Projection {
    Point<d> force;
    Tensor2<d> derivative;
  };
  // The allowed force that is nearest to one, and how it follows it.
  Projection nearest(const Point<d>& to) const {
    const Tensor2<d> tangential = Tensor2<d>::Identity() - normal * normal.transpose();
    const Point<d> t = tangential * to;
    const double size = t.norm(), p = to.dot(normal);
    const Point<d> way = slips ? along : size > 0 ? Point<d>(t / size) : Point<d>(Point<d>::Zero());
    if (!slips && (size <= cohesion + (pressed ? coefficient * std::max(p, 0.0) : 0)))  // below the bound
      return {t + (pressed ? std::max(p, 0.0) : 0) * normal,
              tangential + (pressed && p > 0 ? 1.0 : 0.0) * normal * normal.transpose()};
    const Point<d> edge = normal + coefficient * way;
    const double pressure = pressed ? std::max((to - cohesion * way).dot(edge) / edge.squaredNorm(), 0.0) : 0,
                 bound = cohesion + coefficient * pressure;
    Projection out{pressure * normal + bound * way, Tensor2<d>::Zero()};
    if (pressure > 0) out.derivative += edge * edge.transpose() / edge.squaredNorm();
    if (!slips) out.derivative += bound / size * (tangential - way * way.transpose());  // the friction turns
    return out;
  }
  // What it shares of a force.
  Point<d> part(const Point<d>& force) const {
    return pressed ? force : Point<d>(force - force.dot(normal) * normal);
  }
};

template <int d>
std::vector<Sharing<d>> sharing(const ContactProblem<d>& problem, const ContactSolution<d>& solution,
                                double tolerance) {
  double fastest = 0, reach = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> free = problem.free.template segment<d>(row), w = solution.velocity.template segment<d>(row);
    fastest = std::max({fastest, free.norm(), w.norm()});
    reach = std::max(reach, point.displacement.norm() + std::abs(point.gap) + problem.step * (free.norm() + w.norm()));
  }
  std::vector<Sharing<d>> out;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const Friction& friction = law.friction;
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> w = solution.velocity.template segment<d>(row), force = solution.force.template segment<d>(row);
    const Point<d> slip = w - w.dot(point.normal) * point.normal;
    const double speed = slip.norm(), smeared = std::hypot(speed, friction.regularisation);
    const double pressure = std::max(force.dot(point.normal), 0.0) / point.weight;
    const double bound = point.weight * friction.bound(pressure, speed).value;
    // the power that will be missing is at most twice bound times speed
    const bool rests = friction.regularisation == 0 && speed <= tolerance * fastest;
    const double r = point.penetration + problem.step * w.dot(point.normal);
    const bool pressed = law.compliance.rigid() && !point.prescribed && !friction.custom &&
                         friction.limit == unlimited && std::abs(r) <= tolerance * reach;
    if (!pressed && !(rests && bound > 0)) continue;
    Sharing<d> one{static_cast<Eigen::Index>(i), point.weight, bound, 0, pressed, !rests, point.normal, Point<d>::Zero()};
    if (pressed) {
      one.cohesion = point.weight * friction.cohesion;
      one.coefficient = friction.bound(1, speed).by_pressure;
    }
    if (!rests) one.along = slip / smeared;
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
    Point<d> value = Point<d>::Zero();
    for (Shape::InnerIterator it(shape, q.point); it; ++it) value += it.value() * y.template segment<d>(it.col() * d);
    return q.weight * value;
  }
  double value(const Eigen::VectorXd& y) const {
    double sum = -asked.dot(y);
    for (const auto& q : points) {
      const Point<d> wanted = at(q, y), force = q.nearest(wanted).force;
      sum += force.dot(wanted - 0.5 * force) / q.weight;
    }
    return sum;
  }
  Eigen::VectorXd gradient(const Eigen::VectorXd& y) const {
    Eigen::VectorXd out = -asked;
    for (const auto& q : points) add(q, q.nearest(at(q, y)).force, out);
    return out;
  }
  // its generalised derivative, with something on the diagonal for directions in which nothing rests
  Eigen::SparseMatrix<double> curvature(const Eigen::VectorXd& y) const {
    double heaviest = 0;
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& q : points) {
      const Tensor2<d> own = q.weight * q.nearest(at(q, y)).derivative;
      heaviest = std::max(heaviest, q.weight);
      for (Shape::InnerIterator i(shape, q.point); i; ++i)
        for (Shape::InnerIterator j(shape, q.point); j; ++j)
          for (int a = 0; a < d; ++a)
            for (int b = 0; b < d; ++b)
              entries.emplace_back(i.col() * d + a, j.col() * d + b, i.value() * j.value() * own(a, b));
    }
    for (Eigen::Index i = 0; i < asked.size(); ++i) entries.emplace_back(i, i, 1e-12 * heaviest);
    Eigen::SparseMatrix<double> out(asked.size(), asked.size());
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }
  void add(const Sharing<d>& q, const Point<d>& force, Eigen::VectorXd& nodal) const {
    for (Shape::InnerIterator it(shape, q.point); it; ++it)
      nodal.template segment<d>(it.col() * d) += it.value() * force;
  }
};

}  // namespace

template <int d>
bool share_least(const ContactProblem<d>& problem, const Shape& shape, double tolerance, ContactSolution<d>& solution) {
  const std::vector<Sharing<d>> points = sharing(problem, solution, tolerance);
  if (points.empty()) return true;
  const auto name = [&](const Sharing<d>& q) {
    const double pressure = solution.force.template segment<d>(q.point * d).dot(q.normal);
    const bool rubs = q.cohesion + q.coefficient * pressure > 0;
    solution.status[static_cast<std::size_t>(q.point)] =
        !q.slips && rubs ? Status::stick : rubs || pressure > 0 ? Status::slip : Status::open;
  };
  std::for_each(points.begin(), points.end(), name);
  Eigen::VectorXd asked = Eigen::VectorXd::Zero(shape.cols() * d);
  const Dual<d> dual{points, shape, asked};
  double widest = 0;
  for (const auto& q : points) {
    const Point<d> force = solution.force.template segment<d>(q.point * d);
    dual.add(q, q.part(force), asked);
    widest = std::max({widest, q.cohesion, q.part(force).norm()});
  }
  Eigen::VectorXd y = Eigen::VectorXd::Zero(asked.size()), gradient = dual.gradient(y);
  const double enough = 8 * std::numeric_limits<double>::epsilon() * widest;
  for (int step = 0; step < 50 && gradient.cwiseAbs().maxCoeff() > enough; ++step) {
    const Eigen::VectorXd change =
        -Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(dual.curvature(y)).solve(gradient);
    const double before = dual.value(y), slope = gradient.dot(change);
    double length = 1;
    Eigen::VectorXd next = dual.gradient(y + change);
    while (length > 1e-3 && !(next.norm() < gradient.norm()) &&
           dual.value(y + length * change) > before + 1e-4 * length * slope) {
      length /= 2;
      next = dual.gradient(y + length * change);
    }
    y += length * change;
    gradient = next;
  }
  if (!(gradient.cwiseAbs().maxCoeff() <= 0.5 * tolerance * widest)) return false;
  for (const auto& q : points) {
    auto force = solution.force.template segment<d>(q.point * d);
    const Point<d> change = q.nearest(dual.at(q, y)).force - q.part(force);
    force += change;
    solution.added.template segment<d>(q.point * d) += change;
    name(q);
  }
  return true;
}

template bool share_least<2>(const ContactProblem<2>&, const Shape&, double, ContactSolution<2>&);
template bool share_least<3>(const ContactProblem<3>&, const Shape&, double, ContactSolution<3>&);

}  // namespace warmslip
