// The laws of the contact and their residual at one point.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bodies.hpp"
#include "warmslip/contact/residual.hpp"

using namespace warmslip;

namespace {

/// One law of every kind, by name.
std::vector<std::pair<std::string, ContactLaw>> laws() {
  const NormalCompliance linear{50};
  const auto own = [](double r) {
    return std::array<double, 3>{50 * r + 30 * r * r, 50 + 60 * r, 25 * r * r + 10 * r * r * r};
  };
  const auto root = [](double p, double s) {
    return std::array<double, 3>{0.3 * p / (1 + 0.2 * s), 0.3 / (1 + 0.2 * s),
                                 -0.06 * p / ((1 + 0.2 * s) * (1 + 0.2 * s))};
  };
  return {{"Coulomb", {linear, {0.4}}},
          {"frictionless", {linear, {}}},
          {"power", {{60, 1.5}, {0.4}}},
          {"bounded", {{50, 1, 12}, {0.4}}},
          {"bounded power", {{60, 2, 4}, {0.4}}},
          {"cohesion", {linear, {0.4, 0.5}}},
          {"Tresca", {linear, {0, 0.7}}},
          {"cut off", {linear, {0.4, 0.5, 2.0}}},
          {"weakening", {linear, {0.5, 0, unlimited, 0.4, 2.0}}},
          {"regularised", {linear, {0.4, 0, unlimited, 0, 0, 0.1}}},
          {"of the user", {{0, 1, unlimited, own}, {0, 0, unlimited, 0, 0, 0, root}}}};
}

/// Penetration at which a bounded pressure stops to grow, or the friction that follows it; far away for the others.
double bend(const ContactLaw& law) {
  if (law.friction.limit < unlimited)
    return (law.friction.limit - law.friction.cohesion) / (law.friction.coefficient * 50);
  return law.compliance.pressure_limit < unlimited
             ? std::pow(law.compliance.pressure_limit / law.compliance.stiffness, 1 / law.compliance.exponent)
             : 1e9;
}

}  // namespace

TEST_CASE_TEMPLATE("the derivative of the law's residual is its finite difference", D, Two, Three) {
  constexpr int d = D::value;
  const double k = 0.2, step = 1e-6;
  const PointCompliance own{0.02, 1.4};
  for (const auto& [name, law] : laws()) {
    CAPTURE(name);
    Random random(3);
    std::array<int, 3> seen{};
    for (int trial = 0; trial < 400; ++trial) {
      const ContactPoint<d> point{random.point<d>().normalized(), 0.5, 0.2 * random() + 0.1, Point<d>::Zero(), 0};
      const Point<d> f = 2 * random.point<d>(), w = random.point<d>();
      const auto at = [&](const Point<d>& force, const Point<d>& velocity) {
        return residual<d>(law, point, k, own, force, velocity);
      };
      const auto here = at(f, w);
      Tensor2<d> by_force, by_velocity;
      bool kink = false;
      for (int a = 0; a < d; ++a) {
        const Point<d> e = step * Point<d>::Unit(a);
        const auto f1 = at(f + e, w), f0 = at(f - e, w), w1 = at(f, w + e), w0 = at(f, w - e);
        for (const auto* side : {&f1, &f0, &w1, &w0}) kink = kink || side->key() / 10 != here.key() / 10;
        by_force.col(a) = (f1.value - f0.value) / (2 * step);
        by_velocity.col(a) = (w1.value - w0.value) / (2 * step);
      }
      const double r = point.penetration + k * w.dot(point.normal), y = r + own.normal * f.dot(point.normal);
      const double lambda = f.dot(point.normal), p = law.compliance.pressure(bend(law));
      if (kink || std::abs(r - bend(law)) < 1e-3 || std::abs(y - bend(law) - own.normal * point.weight * p) < 1e-3 ||
          std::abs(lambda / point.weight - p) < 1e-3)
        continue;
      ++seen[static_cast<std::size_t>(here.status)];
      CHECK((by_force - here.by_force).norm() <= 1e-7 * (1 + here.by_force.norm()));
      CHECK((by_velocity - here.by_velocity).norm() <= 1e-6 * (1 + here.by_velocity.norm()));
    }
    CHECK(seen[0] + seen[1] + seen[2] > 200);
    if (law.piecewise_linear() && law.friction.coefficient > 0 && law.friction.cohesion == 0)
      for (const int count : seen) CHECK(count > 10);
  }
}

TEST_CASE("pressure is the slope of its energy, and its tangent the slope of it") {
  for (const auto& [name, law] : laws())
    for (const double r : {-0.1, 0.01, 0.05, 0.13, 0.3, 0.9}) {
      CAPTURE(name);
      CAPTURE(r);
      const auto& p = law.compliance;
      const double e = 1e-6;
      CHECK((p.energy(r + e) - p.energy(r - e)) / (2 * e) == doctest::Approx(p.pressure(r)).epsilon(1e-6));
      CHECK((p.pressure(r + e) - p.pressure(r - e)) / (2 * e) == doctest::Approx(p.tangent(r)).epsilon(1e-6));
      CHECK(p.energy(0) == 0);
    }
}

TEST_CASE_TEMPLATE("every law is solved within 1e-12", D, Two, Three) {
  constexpr int d = D::value;
  for (const auto& [name, law] : laws())
    for (unsigned seed = 0; seed < 20; ++seed) {
      CAPTURE(name);
      CAPTURE(seed);
      Body<d> body = random_body<d>(seed, 1 + static_cast<int>(seed % 8), 0.3);
      body.problem.laws = {law};
      ContactSolver<d> solver(body.compliance);
      const auto s = solver.solve(body.problem, Eigen::VectorXd::Zero(body.problem.free.size()));
      REQUIRE(s.converged);
      CHECK(law_residual(body.problem, s.force, s.velocity) <= 1e-12);
      for (std::size_t i = 0; i < body.problem.points.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i) * d;
        const auto& point = body.problem.points[i];
        const Point<d> f = s.force.template segment<d>(row), w = s.velocity.template segment<d>(row);
        const double r = point.penetration + body.problem.step * w.dot(point.normal);
        const Point<d> slip = w - w.dot(point.normal) * point.normal;
        const Point<d> traction = f - f.dot(point.normal) * point.normal;
        const double bound = point.weight * law.friction.bound(law.compliance.pressure(r), slip.norm()).value;
        CHECK(f.dot(point.normal) == doctest::Approx(point.weight * law.compliance.pressure(r)).epsilon(1e-9));
        CHECK(traction.norm() <= bound * (1 + 1e-9) + 1e-11);
        CHECK(traction.dot(slip) ==
              doctest::Approx(friction_power(law.friction, bound, slip.norm())).epsilon(1e-8).scale(1e-3));
      }
    }
}

TEST_CASE_TEMPLATE("the residual vanishes exactly on the law", D, Two, Three) {
  constexpr int d = D::value;
  const ContactLaw law{{50}, {0.4}};
  const ContactPoint<d> point{-Point<d>::Unit(d - 1), 0.5, 0.1, Point<d>::Zero(), 0};
  const double p = 0.5 * 50 * 0.1, k = 0.2;
  const Point<d> nu = point.normal, tau = Point<d>::Unit(0), still = Point<d>::Zero();
  const auto size = [&](const Point<d>& f, const Point<d>& w) {
    return residual<d>(law, point, k, {0.2, 1.4}, f, w).value.norm();
  };
  CHECK(size(p * nu + 0.3 * p * tau, still) <= 1e-14);    // sticks
  CHECK(size(p * nu + 0.4 * p * tau, 2 * tau) <= 1e-14);  // slips, the body's force on the foundation along w
  CHECK(size(p * nu - 0.4 * p * tau, 2 * tau) > 0.1);     // friction that pushes
  CHECK(size(p * nu + 0.5 * p * tau, still) > 0.1);       // beyond the cone
  CHECK(size(p * nu + 0.3 * p * tau, 2 * tau) > 0.1);     // slips below the bound
  CHECK(size(still, -k * 10 * nu) <= 1e-14);              // open
}

TEST_CASE_TEMPLATE("a number that overflowed obeys no law", D, Two, Three) {
  constexpr int d = D::value;
  Body<d> body = random_body<d>(5, 2, 0.3);
  const auto s = ContactSolver<d>(body.compliance).solve(body.problem, Eigen::VectorXd::Zero(2 * d));
  REQUIRE(s.converged);
  Eigen::VectorXd force = s.force, velocity = s.velocity;
  force[0] = unlimited;
  CHECK(law_residual<d>(body.problem, force, s.velocity) == unlimited);
  velocity[0] = unlimited;
  CHECK(law_residual<d>(body.problem, s.force, velocity) == unlimited);
  body.problem.points[0].displacement[0] = unlimited;
  CHECK(law_residual<d>(body.problem, s.force, s.velocity) == unlimited);
}

TEST_CASE_TEMPLATE("a pull and a depth of rounding on a rigid foundation are a residual of rounding", D, Two, Three) {
  constexpr int d = D::value;
  Body<d> body = random_body<d>(3, 2, 0.0);
  body.problem.laws[0].compliance.stiffness = unlimited;
  const auto normal = [&](std::size_t i) { return body.problem.points[i].normal; };
  Eigen::VectorXd force(2 * d), velocity(2 * d);
  for (const double depth : {1e-15, -1e-15, 1e-3})
    for (const double pull : {1e-15, 0.0, -1e-15, 1e-3}) {
      force << -pull * normal(0), normal(1);
      for (std::size_t i = 0; i < 2; ++i) {
        const double wanted = i == 0 ? depth : 0;
        velocity.segment<d>(static_cast<Eigen::Index>(i) * d) =
            (wanted - body.problem.points[i].penetration) / body.problem.step * normal(i);
      }
      const double found = law_residual<d>(body.problem, force, velocity);
      CAPTURE(depth);
      CAPTURE(pull);
      if (depth == 1e-3 || pull == 1e-3)
        CHECK((found >= 1e-5 && found <= 1e-1));
      else
        CHECK(found <= 1e-13);
    }
}

TEST_CASE_TEMPLATE("a flight and a distant wall excuse no force", D, Two, Three) {
  constexpr int d = D::value;
  const Point<d> down = -Point<d>::Unit(d - 1), west = -Point<d>::Unit(0);
  const double k = 2, stiffness = 1e9, depth = 1e-9;
  ContactProblem<d> problem{{{{stiffness}, {0.0}}}, k, {}, Eigen::VectorXd::Zero(2 * d)};
  problem.points = {{down, 0.5, depth, depth * down, 0}, {west, 0.5, -15000, Point<d>::Zero(), 15000}};
  Eigen::VectorXd force = Eigen::VectorXd::Zero(2 * d), velocity(2 * d);
  velocity << 140 * west, 140 * west;
  problem.free = velocity;
  force.head<d>() = 0.5 * stiffness * depth * down;
  CHECK(law_residual<d>(problem, force, velocity) <= 1e-15);
  CHECK(law_residual<d>(problem, 1.001 * force, velocity) >= 1e-4);
}

TEST_CASE_TEMPLATE("a fall along a wall has penetrations of rounding", D, Two, Three) {
  constexpr int d = D::value;
  const Point<d> down = -Point<d>::Unit(d - 1), west = -Point<d>::Unit(0);
  for (const double stiffness : {1e9, unlimited}) {
    ContactProblem<d> problem{{{{stiffness}, {0.3}}}, 0.5, {}, Eigen::VectorXd::Zero(2 * d)};
    problem.points = {{west, 0.5, 0, 3 * down, 0}, {west, 0.5, 0, 3 * down, 0}};
    for (const double depth : {1e-16, 1e-12}) {  // of the second point alone
      Eigen::VectorXd force = Eigen::VectorXd::Zero(2 * d), velocity(2 * d);
      velocity << 2 * down, 2 * down + depth / problem.step * west;
      force.head<d>() = 1e-17 * (west + 0.3 * down);
      const double found = law_residual<d>(problem, force, velocity);
      CAPTURE(depth);
      if (depth == 1e-16)
        CHECK(found <= 1e-15);
      else
        CHECK(found >= 0.5);
    }
  }
}
