#include "warmslip/mesh/quadrature.hpp"

#include <cmath>
#include <stdexcept>

namespace warmslip {
namespace {

// Gauss's points for the weight (1-x)^a on [0,1], by Golub & Welsch, Math. Comp. 23, 1969.
std::pair<Eigen::VectorXd, Eigen::VectorXd> gauss_jacobi(int n, int a) {
  Eigen::VectorXd diagonal(n), off(std::max(n - 1, 0));
  for (int i = 0; i < n; ++i) {
    const double s = 2.0 * i + a;
    diagonal[i] = a == 0 ? 0.0 : -a * a / (s * (s + 2));
    if (i > 0) off[i - 1] = std::sqrt(4.0 * i * (i + a) * i * (i + a) / (s * s * (s * s - 1)));
  }
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, off);
  const Eigen::VectorXd points = (solver.eigenvalues().array() + 1) / 2;
  const Eigen::VectorXd weights = solver.eigenvectors().row(0).transpose().array().square();
  return {points, weights};  // weights sum to 1
}

}  // namespace

Rule simplex_rule(int dim, int n) {
  if (dim < 1 || dim > 3 || n < 1)
    throw std::invalid_argument("a simplex rule needs dimension 1 to 3 and n >= 1 points");
  int total = 1;
  for (int a = 0; a < dim; ++a) total *= n;
  Rule rule{RealTable<Eigen::Dynamic>(total, dim + 1), Eigen::VectorXd::Ones(total)};
  for (int q = 0; q < total; ++q) {
    double rest = 1;
    for (int a = 0, digits = q; a < dim; ++a, digits /= n) {
      const auto [points, weights] = gauss_jacobi(n, dim - 1 - a);
      rule.barycentric(q, a + 1) = rest * points[digits % n];
      rule.weights[q] *= weights[digits % n];
      rest *= 1 - points[digits % n];
    }
    rule.barycentric(q, 0) = rest;
  }
  return rule;
}

Rule vertex_rule(int dim) {
  return {RealTable<Eigen::Dynamic>::Identity(dim + 1, dim + 1), Eigen::VectorXd::Constant(dim + 1, 1.0 / (dim + 1))};
}

}  // namespace warmslip
