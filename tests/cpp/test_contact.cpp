// The contact law at one point and the solver on small bodies given by their compliance alone.
#include <doctest/doctest.h>

#include <random>
#include <string>
#include <vector>

#include "warmslip/contact/minimal_forces.hpp"
#include "warmslip/contact/residual.hpp"
#include "warmslip/contact/solver.hpp"

using namespace warmslip;

namespace {

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

/// How far a solution is from (2.8), (2.9), written down anew: force per weight against pressure, bound and direction.
template <int d>
double defect(const Body<d>& body, const ContactSolution<d>& s) {
  const Eigen::VectorXd velocity = body.problem.free - body.compliance * s.force;
  double worst = (velocity - s.velocity).norm();
  for (std::size_t i = 0; i < body.problem.points.size(); ++i) {
    const auto& point = body.problem.points[i];
    const auto row = static_cast<Eigen::Index>(i) * d;
    const Point<d> f = s.force.template segment<d>(row) / point.weight, w = velocity.template segment<d>(row);
    const double p = body.problem.laws[0].compliance.stiffness *
                     std::max(0.0, (point.displacement + body.problem.step * w).dot(point.normal) - point.gap);
    const Point<d> lambda = f - f.dot(point.normal) * point.normal, slip = w - w.dot(point.normal) * point.normal;
    const double bound = body.problem.laws[0].friction.coefficient * p;
    worst = std::max({worst, std::abs(f.dot(point.normal) - p), lambda.norm() - bound,
                      std::abs(lambda.dot(slip) - bound * slip.norm())});
  }
  return worst;
}

ContactOptions only(int newton, int tresca_fixed_point, int enumerate) {
  ContactOptions options;
  options.newton_steps = newton;
  options.fixed_point_steps = tresca_fixed_point;
  options.enumerate_points = enumerate;
  return options;
}

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

TEST_CASE_TEMPLATE("random bodies: the law within 1e-12, whatever it takes", D, Two, Three) {
  constexpr int d = D::value;
  std::array<int, 3> statuses{};
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Body<d> body = random_body<d>(seed, 1 + static_cast<int>(seed % 12), seed % 4 * 0.15);
    ContactSolver<d> solver(body.compliance);
    const auto s = solver.solve(body.problem, Eigen::VectorXd::Zero(body.problem.free.size()));
    CAPTURE(seed);
    REQUIRE(s.converged);
    CHECK(s.law_residual <= 1e-12);
    CHECK(defect(body, s) <= 1e-10);
    CHECK(law_residual(body.problem, s.force, s.velocity) <= 1e-12);
    // a wrong force shows in the penetration, the less the stiffer the foundation is
    if (s.force.norm() > 0) CHECK(law_residual<d>(body.problem, 1.001 * s.force, s.velocity) >= 1e-6);
    for (const Status status : s.status) ++statuses[static_cast<std::size_t>(status)];
    // again from the answer: nothing is left to do
    CHECK(solver.solve(body.problem, s.force).iterations == 0);
  }
  for (const int count : statuses) CHECK(count > 5);
}

// A correction far below the tolerance is found with the statuses that it leads to, one after the other: where every
// point is at its friction bound and at rest, the answer to a small change of the velocities is proportional to it.
TEST_CASE_TEMPLATE("small corrections of a known solution are proportional to their cause", D, Two, Three) {
  constexpr int d = D::value;
  int several = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Body<d> body = random_body<d>(seed, 6, 0.5);
    Random random(1000 + seed);
    ContactProblem<d>& problem = body.problem;
    const auto n = static_cast<Eigen::Index>(problem.points.size());
    problem.known_force.resize(n * d);
    Eigen::VectorXd cause(n * d);
    for (double& entry : cause) entry = random();
    for (Eigen::Index i = 0; i < n; ++i) {
      auto& point = problem.points[static_cast<std::size_t>(i)];
      const double pressing = 1 << (i % 3);  // sums and bounds of these forces are exact
      point.normal = Point<d>::Unit(d - 1);
      point.weight = 0.5;
      problem.known_force.template segment<d>(i * d) =
          pressing * (point.normal + (random() > 0 ? 0.5 : -0.5) * Point<d>::Unit(0));
      point.penetration = pressing / (point.weight * problem.laws[0].compliance.stiffness);
      point.gap = point.displacement.dot(point.normal) - point.penetration;
    }
    const auto answer = [&](double size) {
      problem.known_velocity = size * cause;
      problem.free = problem.known_velocity + body.compliance * problem.known_force;
      ContactSolver<d> solver(body.compliance);
      const ContactSolution<d> found = solver.solve(problem, problem.known_force);
      REQUIRE(found.converged);
      return found;
    };
    const ContactSolution<d> large = answer(1e-8), small = answer(4e-15);
    CAPTURE(seed);
    CHECK((small.added / 4e-15 - large.added / 1e-8).norm() <= 0.1 * (large.added / 1e-8).norm());
    several += large.iterations > 2;
  }
  CHECK(several >= 2);  // where one step has the right statuses, nothing is tried
}

TEST_CASE("three points: Newton, fixed point and enumeration agree") {
  for (unsigned seed = 100; seed < 130; ++seed) {
    const Body<2> body = random_body<2>(seed, 1 + static_cast<int>(seed % 3), 0.2);
    const Eigen::VectorXd guess = Eigen::VectorXd::Zero(body.problem.free.size());
    ContactSolver<2> newton(body.compliance), slow(body.compliance, only(0, 20000, 0)),
        all(body.compliance, only(0, 0, 6));
    const auto a = newton.solve(body.problem, guess), b = slow.solve(body.problem, guess),
               c = all.solve(body.problem, guess);
    CAPTURE(seed);
    REQUIRE(a.converged);
    REQUIRE(b.converged);
    REQUIRE(c.converged);
    if (c.force.norm() > 0) {  // an open body is right from the start
      CHECK(a.stage == Stage::newton);
      CHECK(b.stage == Stage::tresca_fixed_point);
      CHECK(c.stage == Stage::enumeration);
    }
    CHECK((a.force - c.force).norm() <= 1e-10 * (1 + c.force.norm()));
    CHECK((b.force - c.force).norm() <= 1e-10 * (1 + c.force.norm()));
    CHECK(defect(body, c) <= 1e-10);
  }
}

TEST_CASE_TEMPLATE("failure is said and never thrown", D, Two, Three) {
  constexpr int d = D::value;
  Body<d> body = random_body<d>(7, 4, 0.3);
  for (auto& point : body.problem.points) point.penetration = 1;
  const Eigen::VectorXd guess = Eigen::VectorXd::Zero(body.compliance.rows());
  const auto nothing = ContactSolver<d>(body.compliance, only(0, 0, 0)).solve(body.problem, guess);
  CHECK_FALSE(nothing.converged);
  CHECK(nothing.law_residual > 1e-3);
  auto impossible = only(20, 200, 6);
  impossible.tolerance = -1;
  CHECK_FALSE(ContactSolver<d>(body.compliance, impossible).solve(body.problem, guess).converged);
  const auto slow = ContactSolver<d>(body.compliance, only(0, 20000, 0)).solve(body.problem, guess);
  CHECK(slow.converged);
  CHECK(slow.stage == Stage::tresca_fixed_point);
  body.problem.free[1] = NAN;
  CHECK_FALSE(ContactSolver<d>(body.compliance).solve(body.problem, guess).converged);
  CHECK_THROWS_AS(ContactSolver<d>(Eigen::MatrixXd::Identity(d, d + 1)), std::invalid_argument);
}

TEST_CASE_TEMPLATE("points that outnumber their nodes share the least forces, whichever they had", D, Two, Three) {
  constexpr int d = D::value;
  constexpr int nodes = 5, points = 3 * (nodes - 1);  // a row of nodes, three points between two of them
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape(points, nodes), vector_shape(d * points, d * nodes);
  for (int q = 0; q < points; ++q) {
    const double at = 0.1 + 0.4 * (q % 3);
    for (const auto& [node, value] : {std::pair{q / 3, 1 - at}, std::pair{q / 3 + 1, at}}) {
      shape.insert(q, node) = value;
      for (int a = 0; a < d; ++a) vector_shape.insert(q * d + a, node * d + a) = value;
    }
  }
  int compared = 0, rested = 0, slipped = 0, moved = 0, clipped = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const double friction = 0.05 + 0.1 * (seed % 8), stiffness = seed % 3 == 0 ? unlimited : 100;
    const Body<d> body = random_body<d>(seed, nodes, friction, stiffness);
    const Eigen::VectorXd push = Point<d>::Unit(d - 1).replicate(nodes, 1);  // mostly towards the foundation
    ContactProblem<d> problem{
        body.problem.laws, body.problem.step, {}, vector_shape * (0.5 * body.problem.free + 2 * push)};
    Random random(seed + 1000);
    for (int q = 0; q < points; ++q) {
      const Point<d> normal = Point<d>::Unit(d - 1), u = 0.1 * random.template point<d>();
      problem.points.push_back({normal, 0.3 + 0.2 * (q % 3), u.dot(normal) + 0.1, u, -0.1});
    }
    ContactOptions options;
    options.proximal = 1e-8;
    ContactSolver<d> solver(vector_shape * body.compliance * vector_shape.transpose(), options);
    std::vector<ContactSolution<d>> found;
    for (int guess = 0; guess < 3; ++guess) {
      Eigen::VectorXd force(points * d);
      for (double& entry : force) entry = 3 * guess * random();
      found.push_back(solver.solve(problem, force));
    }
    if (!found[0].converged || !found[1].converged || !found[2].converged) continue;
    const std::vector<ContactSolution<d>> before = found;
    for (auto& one : found) CHECK(minimal_forces(problem, shape, options.tolerance, one));
    const auto size = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
      double sum = 0;
      for (int q = 0; q < points; ++q)
        sum += a.template segment<d>(q * d).dot(b.template segment<d>(q * d)) /
               problem.points[static_cast<std::size_t>(q)].weight;
      return sum;
    };
    const Eigen::VectorXd& least = found[0].force;
    for (int i = 0; i < 3; ++i) {
      if ((found[i].velocity - found[0].velocity).norm() > 1e-9) continue;  // strong friction: another motion as well
      ++compared;
      CHECK((found[i].force - least).norm() <= 1e-7 * least.norm());
      CHECK(found[i].status == found[0].status);
      CHECK((vector_shape.transpose() * (found[i].force - before[i].force)).norm() <= 1e-11 * least.norm());
      CHECK(law_residual(problem, found[i].force, found[i].velocity) <= 2e-12);
      CHECK(size(least, before[i].force - least) >= -1e-9 * size(least, least));  // the nearest to zero of a convex set
      moved += (before[i].force - least).norm() > 1e-3 * least.norm();
    }
    for (int q = 0; q < points; ++q) {
      const Status status = found[0].status[static_cast<std::size_t>(q)];
      slipped += status == Status::slip && stiffness == unlimited;
      if (status != Status::stick) continue;
      ++rested;
      const Point<d> f = least.template segment<d>(q * d);
      const double bound = friction * std::max(f[d - 1], 0.0);
      clipped += std::sqrt(std::max(f.squaredNorm() - f[d - 1] * f[d - 1], 0.0)) > bound * (1 - 1e-9);
    }
  }
  CHECK(compared > 450);
  CHECK(rested > 100);
  CHECK(slipped > 100);
  CHECK(moved > 10);
  CHECK(clipped > 2);
}
