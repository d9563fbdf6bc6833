// Factorizations and the stepper on the paper's problem in the plane and one dimension up, on any number of ranks.
#include <doctest/doctest.h>

#include "paper.hpp"
#include "trapping.hpp"

using namespace warmslip;

namespace {

using Two = std::integral_constant<int, 2>;
using Three = std::integral_constant<int, 3>;

/// Steps to T = 1 whose balances close.
template <int d>
struct Paper : PaperProblem<d> {
  using PaperProblem<d>::PaperProblem;
  using PaperProblem<d>::layout, PaperProblem<d>::surface;

  /// |u|_V, |w|, |theta|, normal force after `steps` steps to T = 1, every balance within 1e-11 on the way. With
  /// `refine`, every step gets the iterative refinement that only fine meshes need.
  Eigen::Vector4d run(int steps, Coupling coupling, Backend backend = Backend::automatic, bool refine = false) {
    const Trapping trapping;
    StepperOptions options{1.0 / steps, coupling, backend, {}};
    if (refine) options.refinement = -1;
    Stepper<d> stepper = PaperProblem<d>::stepper(options);
    this->start(stepper);
    StepReport<d> report;
    for (int n = 0; n < steps; ++n) {
      report = stepper.advance(this->loads());
      REQUIRE(report.outcome == Outcome::completed);
      const Balances& l = report.balances;
      CHECK(std::max({l.energy_residual, l.heat_residual, l.force_residual}) <= 1e-11);
      CHECK(l.law_residual <= 1e-11);
      CHECK(std::min({l.inertia_damping, l.elastic_damping, l.contact_damping, l.viscous, l.friction, l.heat_damping,
                      l.conducted}) >= 0);
      CHECK(report.open + report.stick + report.slip == surface.points());
    }
    CHECK(stepper.steps() == steps);
    CHECK(stepper.time() == doctest::Approx(1).epsilon(1e-14));
    CHECK(report.slip > 0);
    CHECK((refine ? stepper.cost().refinements >= steps : stepper.cost().refinements == 0));
    const Norms<d> norms(layout);
    return {norms.v(stepper.level().u), norms.l2(stepper.level().w), norms.l2(stepper.level().theta),
            report.normal_force};
  }
};

/// Within 1e-10, with what was found in the message.
void check_near(const Eigen::Vector4d& found, const Eigen::Vector4d& stored) {
  const Eigen::IOFormat digits(Eigen::FullPrecision, 0, ", ", ", ");
  std::ostringstream text;
  text << found.transpose().format(digits);
  CAPTURE(text.str());
  CHECK(((found - stored).array() / stored.array()).abs().maxCoeff() <= 1e-10);
}

template <int d>
void check_factor(Paper<d>& paper, Mat matrix, Symmetry symmetry, int block, bool cholmod_serves) {
  const int ranks = static_cast<int>(paper.layout.sum(1.0));
  const auto trailing = paper.surface.unknowns(block);
  const VecHandle right = paper.layout.vector(block), x = duplicate(right), product = duplicate(right),
                  y = duplicate(right);
  paper.layout.distribute(Eigen::VectorXd::LinSpaced(paper.mesh->nodes.rows() * block, -1, 2).array().sin(), right);
  const auto distance = [&](Vec a, Vec b) {
    PetscReal size, difference;
    WARMSLIP_PETSC(VecNorm(a, NORM_2, &size));
    WARMSLIP_PETSC(VecAXPY(a, -1, b));
    WARMSLIP_PETSC(VecNorm(a, NORM_2, &difference));
    return difference / size;
  };
  const auto petsc = factor(matrix, trailing, symmetry, block, "test", Backend::petsc);
  const Eigen::VectorXd held = petsc->reduce(right);
  const Eigen::MatrixXd compliance = petsc->compliance();
  petsc->solve(right, x);
  WARMSLIP_PETSC(MatMult(matrix, x, product));
  CHECK(distance(product, right) <= 1e-11);
  CHECK((compliance - compliance.transpose()).norm() <=
        (symmetry == Symmetry::general ? 1e9 : 1e-11) * compliance.norm());
  // the compliance is what a load on the held-apart unknowns moves them by
  const Eigen::VectorXd load = Eigen::VectorXd::LinSpaced(held.size(), 1, 2);
  petsc->reduce(right);
  petsc->expand(load, x);
  const Eigen::VectorXd moved = petsc->reduce(right) - compliance * load;
  const Eigen::VectorXd values = paper.layout.gather(x);
  if (ranks == 1)
    for (std::size_t i = 0; i < trailing.size(); ++i)
      CHECK(values[trailing[i]] == doctest::Approx(moved[static_cast<Eigen::Index>(i)]).epsilon(1e-9));
  if (ranks > 1 || !cholmod_serves) {
    CHECK_THROWS_AS(factor(matrix, trailing, symmetry, block, "test", Backend::cholmod), std::invalid_argument);
    return;
  }
  const auto cholmod = factor(matrix, trailing, symmetry, block, "test", Backend::cholmod);
  CHECK((cholmod->reduce(right) - held).norm() <= 1e-10 * held.norm());
  CHECK((cholmod->compliance() - compliance).norm() <= 1e-10 * compliance.norm());
  cholmod->expand(load, y);
  CHECK(distance(y, x) <= 1e-10);
  CHECK(cholmod->substitutions() == 1);
  CHECK(cholmod->bytes() > 0);
}

}  // namespace

TEST_CASE_TEMPLATE("both backends factor the same operators", D, Two, Three) {
  constexpr int d = D::value;
  Paper<d> paper(d == 2 ? 6 : 3);
  check_factor<d>(paper, momentum_matrix(paper.layout, paper.problem, paper.operators, 0.1),
                  Symmetry::positive_definite, d, true);
  const auto coupled = [&](Paper<d>& p, double scale, Symmetry symmetry, bool served) {
    check_factor<d>(p, coupled_matrix(p.layout, p.problem, p.operators, 0.1, scale), symmetry, d + 1, served);
  };
  coupled(paper, 1, Symmetry::definite_or_refused, true);
  Paper<d> opposite(d == 2 ? 6 : 3, -1);
  coupled(opposite, -1, Symmetry::symmetric, true);  // quasi-definite: pivots of both signs
  Paper<d> skewed(d == 2 ? 6 : 3, -1);
  coupled(skewed, 1, Symmetry::general, false);
}

TEST_CASE("the plane problem: norms on any number of ranks, every coupling and quadrature") {
  check_near(Paper<2>(8).run(8, Coupling::staggered),
             {0.0495886223914231, 0.0267642744764715, 0.898160618902909, 0.904968185665935});
  check_near(Paper<2>(8).run(8, Coupling::lagged),
             {0.0495863711120781, 0.0267658292699907, 0.898147173550696, 0.904950892322555});
  check_near(Paper<2>(8).run(8, Coupling::monolithic),
             {0.0493399993478305, 0.0267919934062631, 0.898137015288258, 0.907846547541927});
  check_near(Paper<2>(8, -1).run(8, Coupling::monolithic),
             {0.0492981074834062, 0.0267760516730022, 0.89748528460677, 0.908002742864962});
  check_near(Paper<2>(8, 1, 2).run(8, Coupling::staggered),
             {0.049588781597849, 0.0267560100406018, 0.898160727488345, 0.904939810305356});
  check_near(Paper<2>(8).run(8, Coupling::staggered, Backend::petsc),
             {0.0495886223914232, 0.0267642744764716, 0.898160618902908, 0.904968185665936});
}

TEST_CASE_TEMPLATE("refinement changes nothing where it is not needed", D, Two, Three) {
  Paper<D::value> paper(4);
  for (const Coupling coupling : {Coupling::staggered, Coupling::lagged, Coupling::monolithic})
    check_near(paper.run(4, coupling, Backend::automatic, true), paper.run(4, coupling));
}

TEST_CASE("the block: norms on any number of ranks") {
  check_near(Paper<3>(3).run(4, Coupling::staggered),
             {0.0685182367184955, 0.035939233734572, 0.404484873238518, 0.498623575304581});
  check_near(Paper<3>(3, -1).run(4, Coupling::monolithic),
             {0.0682707127499522, 0.0359169669260807, 0.404600527785129, 0.500640793926774});
  check_near(Paper<3>(3, 1, 2).run(4, Coupling::lagged),
             {0.068562728902031, 0.0358658061665048, 0.404470693603612, 0.498397879463677});
}

TEST_CASE_TEMPLATE("a body that leaves its supports is out of balance", D, Two, Three) {
  constexpr int d = D::value;
  const Paper<d> paper(2);
  BalanceEvaluator<d> evaluator(paper.layout, paper.problem, paper.operators, paper.surface);
  const auto still = [&](int block) {
    VecHandle v = paper.layout.vector(block);
    WARMSLIP_PETSC(VecSet(v, 0));
    return v;
  };
  TimeLevel before, after;
  for (TimeLevel* level : {&before, &after}) {
    for (VecHandle* v : {&level->u, &level->w, &level->momentum, &level->elastic_u, &level->expansion_theta})
      *v = still(d);
    for (VecHandle* v : {&level->theta, &level->mass_theta, &level->heating_w}) *v = still(1);
    level->contact_u = level->contact_force = Eigen::VectorXd::Zero(paper.surface.points() * d);
    level->gap = Eigen::VectorXd::Ones(paper.surface.points());
    WARMSLIP_PETSC(VecSet(level->w, 1));  // as a whole: no inner force, and the same momentum
    level->sizes = {0, 1, 1, 0};
  }
  const VecHandle load = still(d), supply = still(1), carried = still(d);
  WARMSLIP_PETSC(VecSet(carried, 1));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(paper.surface.points() * d);
  StepInputs inputs{0.1, load, supply, before.expansion_theta, before.heating_w, 0, 1, none, none, {}, none, carried};
  CHECK(evaluator.evaluate(before, after, inputs).force_residual <= 1e-14);
  inputs.support_velocity = nullptr;  // supports at rest, which the body leaves
  CHECK(evaluator.evaluate(before, after, inputs).force_residual == doctest::Approx(1));
}
