#include "warmslip/contact_share.hpp"

#include <algorithm>
#include <limits>

namespace warmslip {
namespace {

using Shape = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// A point at rest: its index, weight, friction bound as a force, and the projection onto its tangent plane.
template <int d>
struct Resting {
  Eigen::Index point;
  double weight, bound;
  Tensor2<d> tangential;
};

template <int d>
std::vector<Resting<d>> at_rest(const ContactProblem<d>& problem, const ContactSolution<d>& solution,
                                double tolerance) {
  double fastest = 0;
  for (Eigen::Index row = 0; row < problem.free.size(); row += d)
    fastest = std::max(
        {fastest, problem.free.template segment<d>(row).norm(), solution.velocity.template segment<d>(row).norm()});
  std::vector<Resting<d>> out;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ContactPoint<d>& point = problem.points[i];
    const ContactLaw& law = problem.law(i);
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> w = solution.velocity.template segment<d>(row);
    const Tensor2<d> tangential = Tensor2<d>::Identity() - point.normal * point.normal.transpose();
    const double speed = (tangential * w).norm();
    const double pressure = std::max(solution.force.template segment<d>(row).dot(point.normal), 0.0) / point.weight;
    const double bound = point.weight * law.friction.bound(pressure, speed).value;
    // the power that will be missing is at most twice bound times speed
    if (law.friction.regularisation == 0 && bound > 0 && speed <= tolerance * fastest)
      out.push_back({static_cast<Eigen::Index>(i), point.weight, bound, tangential});
  }
  return out;
}

// The dual problem: forces lambda_q = proj_bound(weight y(q)) with nodal y minimise the convex function whose gradient
// is what they put on the nodes less what is asked for.
template <int d>
struct Dual {
  const std::vector<Resting<d>>& points;
  const Shape& shape;
  const Eigen::VectorXd& asked;  // (d nodes)

  Point<d> at(const Resting<d>& q, const Eigen::VectorXd& y) const {
    Point<d> value = Point<d>::Zero();
    for (Shape::InnerIterator it(shape, q.point); it; ++it) value += it.value() * y.template segment<d>(it.col() * d);
    return q.tangential * value;
  }
  static Point<d> force(const Resting<d>& q, const Point<d>& y) {
    const double size = q.weight * y.norm();
    return size > q.bound ? Point<d>(q.bound / y.norm() * y) : Point<d>(q.weight * y);
  }
  double value(const Eigen::VectorXd& y) const {
    double sum = -asked.dot(y);
    for (const auto& q : points) {
      const double size = at(q, y).norm();
      sum += q.weight * size > q.bound ? q.bound * (size - 0.5 * q.bound / q.weight) : 0.5 * q.weight * size * size;
    }
    return sum;
  }
  Eigen::VectorXd gradient(const Eigen::VectorXd& y) const {
    Eigen::VectorXd out = -asked;
    for (const auto& q : points) add(q, force(q, at(q, y)), out);
    return out;
  }
  // its generalised derivative, with something on the diagonal for directions in which nothing rests
  Eigen::SparseMatrix<double> curvature(const Eigen::VectorXd& y) const {
    double heaviest = 0;
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& q : points) {
      const Point<d> v = at(q, y);
      Tensor2<d> own = q.weight * q.tangential;
      if (q.weight * v.norm() > q.bound)
        own = q.bound / v.norm() * (q.tangential - v * v.transpose() / v.squaredNorm());
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
  void add(const Resting<d>& q, const Point<d>& force, Eigen::VectorXd& nodal) const {
    for (Shape::InnerIterator it(shape, q.point); it; ++it)
      nodal.template segment<d>(it.col() * d) += it.value() * force;
  }
};

}  // namespace

template <int d>
bool share_least(const ContactProblem<d>& problem, const Shape& shape, double tolerance, ContactSolution<d>& solution) {
  const std::vector<Resting<d>> points = at_rest(problem, solution, tolerance);
  if (points.empty()) return true;
  for (const auto& q : points) solution.status[static_cast<std::size_t>(q.point)] = Status::stick;
  Eigen::VectorXd asked = Eigen::VectorXd::Zero(shape.cols() * d);
  const Dual<d> dual{points, shape, asked};
  double widest = 0;
  for (const auto& q : points) {
    dual.add(q, q.tangential * solution.force.template segment<d>(q.point * d), asked);
    widest = std::max(widest, q.bound);
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
    const Point<d> change = dual.force(q, dual.at(q, y)) - q.tangential * Point<d>(force);
    force += change;
    solution.added.template segment<d>(q.point * d) += change;
  }
  return true;
}

template bool share_least<2>(const ContactProblem<2>&, const Shape&, double, ContactSolution<2>&);
template bool share_least<3>(const ContactProblem<3>&, const Shape&, double, ContactSolution<3>&);

}  // namespace warmslip
