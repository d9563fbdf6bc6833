// Tensors, quadrature and element kernels: pure values, checked against closed forms.
#include <doctest/doctest.h>

#include <random>

#include "warmslip/mesh/quadrature.hpp"
#include "warmslip/physics/p1.hpp"

using namespace warmslip;

namespace {

template <int d>
Tensor2<d> random_symmetric(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Tensor2<d> t;
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) t(i, j) = normal(random);
  return 0.5 * (t + t.transpose());
}

/// A simplex of volume O(1), positively oriented, with no symmetry.
template <int d>
Vertices<d> some_simplex() {
  Vertices<d> x;
  if constexpr (d == 2)
    x << 0.1, -0.2, 1.3, 0.2, 0.4, 0.9;
  else
    x << 0.1, -0.2, 0.3, 1.3, 0.2, 0.1, 0.4, 1.1, -0.1, 0.2, 0.3, 1.2;
  return x;
}

/// Nodal values of v(x) = shift + G x, node-major.
template <int d>
Eigen::Matrix<double, d*(d + 1), 1> affine(const Vertices<d>& x, const Point<d>& shift, const Tensor2<d>& g) {
  Eigen::Matrix<double, d*(d + 1), 1> v;
  for (int i = 0; i <= d; ++i) v.template segment<d>(i * d) = shift + g * x.row(i).transpose();
  return v;
}

double factorial(int n) { return std::tgamma(n + 1.0); }

}  // namespace

TEST_CASE_TEMPLATE("Mandel form keeps tensors and their double contraction", D, std::integral_constant<int, 2>,
                   std::integral_constant<int, 3>) {
  constexpr int d = D::value;
  std::mt19937 random(1);
  const Tensor2<d> a = random_symmetric<d>(random), b = random_symmetric<d>(random);
  CHECK((from_mandel<d>(to_mandel<d>(a)) - a).norm() <= 1e-15 * a.norm());
  CHECK(to_mandel<d>(a).dot(to_mandel<d>(b)) == doctest::Approx(a.cwiseProduct(b).sum()).epsilon(1e-14));
  Tensor2<d> skewed = a;
  skewed(0, 1) += 1;
  skewed(1, 0) -= 1;
  CHECK((to_mandel<d>(skewed) - to_mandel<d>(a)).norm() <= 1e-15);
  const double lambda = 1.7, mu = 0.6;
  const Tensor2<d> stress = from_mandel<d>(isotropic<d>(lambda, mu) * to_mandel<d>(a));
  CHECK((stress - (lambda * a.trace() * Tensor2<d>::Identity() + 2 * mu * a)).norm() <= 1e-14 * stress.norm());
}

TEST_CASE("simplex rules are exact to degree 2n-1, positive and inside") {
  for (int dim = 1; dim <= 3; ++dim)
    for (int n = 1; n <= 6; ++n) {
      const Rule rule = simplex_rule(dim, n);
      CHECK(rule.weights.size() == static_cast<Eigen::Index>(std::lround(std::pow(n, dim))));
      CHECK(rule.weights.minCoeff() > 0);
      CHECK(rule.barycentric.minCoeff() > 0);
      CHECK((rule.barycentric.rowwise().sum().array() - 1).abs().maxCoeff() <= 1e-14);
      const auto check = [&](int a, int b, int c) {
        const Eigen::ArrayXd x = rule.barycentric.col(1), y = rule.barycentric.col(std::min(2, dim)),
                             z = rule.barycentric.col(dim);
        const double found = (rule.weights.array() * x.pow(a) * y.pow(b) * z.pow(c)).sum();
        const double exact = factorial(dim) * factorial(a) * factorial(b) * factorial(c) / factorial(dim + a + b + c);
        CHECK(found == doctest::Approx(exact).epsilon(1e-12));
      };
      const int degree = 2 * n - 1;
      for (int a = 0; a <= degree; ++a)
        for (int b = 0; b <= (dim > 1 ? degree - a : 0); ++b)
          for (int c = 0; c <= (dim > 2 ? degree - a - b : 0); ++c) check(a, b, c);
    }
  CHECK_THROWS_AS(simplex_rule(4, 1), std::invalid_argument);
  CHECK_THROWS_AS(simplex_rule(2, 0), std::invalid_argument);
  // one degree more is not integrated: the check above can fail
  const Rule rule = simplex_rule(1, 2);
  CHECK(std::abs((rule.weights.array() * rule.barycentric.col(1).array().pow(4)).sum() - 0.2) > 1e-4);
}

TEST_CASE_TEMPLATE("element kernels: rigid motions, affine fields and moments", D, std::integral_constant<int, 2>,
                   std::integral_constant<int, 3>) {
  constexpr int d = D::value;
  std::mt19937 random(2);
  const Vertices<d> x = some_simplex<d>();
  const Simplex<d> s = simplex<d>(x);
  REQUIRE(s.volume > 0);
  CHECK(s.gradients.colwise().sum().norm() <= 1e-14);
  const Tensor4<d> c = isotropic<d>(1.3, 0.7);
  const VectorBlock<d> a = strain_energy<d>(s, c);
  CHECK((a - a.transpose()).norm() <= 1e-14 * a.norm());

  SUBCASE("translations and rotations store no energy") {
    Tensor2<d> spin = random_symmetric<d>(random);
    spin = Tensor2<d>(spin.template triangularView<Eigen::StrictlyUpper>());
    spin = (spin - spin.transpose()).eval();
    const auto rigid = affine<d>(x, Point<d>::Ones(), spin);
    CHECK((a * rigid).norm() <= 1e-13 * a.norm() * rigid.norm());
    CHECK((strain_matrix<d>(s) * rigid).norm() <= 1e-13 * rigid.norm());
    CHECK((coupling<d>(s, random_symmetric<d>(random)).transpose() * rigid).norm() <= 1e-13 * rigid.norm());
  }
  SUBCASE("affine displacements store exactly volume eps : C eps") {
    const Tensor2<d> g = random_symmetric<d>(random), h = random_symmetric<d>(random);
    const auto v = affine<d>(x, Point<d>::Ones(), g), w = affine<d>(x, Point<d>::Zero(), h);
    const double exact = s.volume * to_mandel<d>(h).dot(c * to_mandel<d>(g));
    CHECK(w.dot(a * v) == doctest::Approx(exact).epsilon(1e-13));
  }
  SUBCASE("conduction of affine temperatures") {
    const Tensor2<d> k = random_symmetric<d>(random) + 3 * Tensor2<d>::Identity();
    const Point<d> g = Point<d>::LinSpaced(1, 2), h = Point<d>::LinSpaced(-1, 3);
    const Eigen::Matrix<double, d + 1, 1> theta = x * g, eta = x * h;
    CHECK(eta.dot(conduction<d>(s, k) * theta) == doctest::Approx(s.volume * h.dot(k * g)).epsilon(1e-13));
  }
  SUBCASE("masses integrate products of hats") {
    const Eigen::Matrix<double, d + 1, d + 1> m = mass<d + 1>(s.volume);
    CHECK(m.sum() == doctest::Approx(s.volume).epsilon(1e-14));
    CHECK(m(0, 0) == doctest::Approx(2 * m(0, 1)).epsilon(1e-14));
    const Rule rule = simplex_rule(d, 2);
    const Eigen::MatrixXd exact =
        s.volume * rule.barycentric.transpose() * rule.weights.asDiagonal() * rule.barycentric;
    CHECK((m - exact).norm() <= 1e-14);
    const auto ones = affine<d>(x, Point<d>::Unit(1), Tensor2<d>::Zero());
    CHECK(ones.dot(vector_mass<d>(s) * ones) == doctest::Approx(s.volume).epsilon(1e-14));
  }
  SUBCASE("coupling is int theta T : eps(v)") {
    const Tensor2<d> t = random_symmetric<d>(random), g = random_symmetric<d>(random);
    const auto v = affine<d>(x, Point<d>::Zero(), g);
    const Point<d> slope = Point<d>::LinSpaced(1, 2);
    const Eigen::Matrix<double, d + 1, 1> theta = x * slope;
    const double exact = s.volume * theta.mean() * t.cwiseProduct(g).sum();
    CHECK(v.dot(coupling<d>(s, t) * theta) == doctest::Approx(exact).epsilon(1e-13));
  }
  SUBCASE("an inverted simplex has negative volume") {
    Vertices<d> y = x;
    y.row(0).swap(y.row(1));
    CHECK(simplex<d>(y).volume == doctest::Approx(-s.volume).epsilon(1e-14));
  }
}
