// The contact solver on small bodies that are given by their compliance alone.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "bodies.hpp"
#include "warmslip/contact/minimal_forces.hpp"
#include "warmslip/contact/residual.hpp"

using namespace warmslip;

namespace {

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

}  // namespace

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
  Eigen::SparseMatrix<double, Eigen::RowMajor> vector_shape(d * points, d * nodes);
  for (int q = 0; q < points; ++q) {
    const double at = 0.1 + 0.4 * (q % 3);
    for (const auto& [node, value] : {std::pair{q / 3, 1 - at}, std::pair{q / 3 + 1, at}}) {
      for (int a = 0; a < d; ++a) vector_shape.insert(q * d + a, node * d + a) = value;
    }
  }
  int compared = 0, rested = 0, slipped = 0, moved = 0, clipped = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
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
    for (auto& one : found) CHECK(minimal_forces(problem, vector_shape, options.tolerance, one));
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
