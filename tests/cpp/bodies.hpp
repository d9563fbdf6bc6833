// Random bodies that are given by the compliance of their contact points alone.
#pragma once
#include <random>
#include <type_traits>

#include "warmslip/contact/solver.hpp"

namespace warmslip {

using Two = std::integral_constant<int, 2>;
using Three = std::integral_constant<int, 3>;

struct Random {
  explicit Random(unsigned seed) : engine(seed) {}
  std::mt19937 engine;
  double operator()() { return std::normal_distribution<double>()(engine); }
  template <int d>
  Point<d> point() {
    Point<d> p;
    for (int a = 0; a < d; ++a) p[a] = (*this)();
    return p;
  }
};

template <int d>
struct Body {
  Eigen::MatrixXd compliance;
  ContactProblem<d> problem;
};

/// A random symmetric positive definite compliance and random data, some points open, some closed.
template <int d>
Body<d> random_body(unsigned seed, int points, double friction, double stiffness = 100) {
  Random random(seed);
  const Eigen::Index n = Eigen::Index{points} * d;
  Eigen::MatrixXd root(n, n);
  for (double& entry : root.reshaped()) entry = random();
  Body<d> body{root * root.transpose() / n + Eigen::MatrixXd::Identity(n, n),
               {{{{stiffness}, {friction}}}, 0.1, {}, Eigen::VectorXd(n)}};
  for (double& entry : body.problem.free) entry = random();
  for (int i = 0; i < points; ++i) {
    const Point<d> normal = random.point<d>().normalized(), displacement = 0.1 * random.point<d>();
    const double gap = 0.05 * random();
    body.problem.points.push_back({normal, 0.5 + 0.1 * i, displacement.dot(normal) - gap, displacement, gap});
  }
  return body;
}

}  // namespace warmslip
