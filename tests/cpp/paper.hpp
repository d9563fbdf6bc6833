// The paper's problem in the plane and one dimension up, as the C++ tests take it.
#pragma once
#include "warmslip/mesh/box.hpp"
#include "warmslip/time/stepper.hpp"

namespace warmslip {

/// The paper's data with K = I, M = I and R = heating I; in 3D on a cube held at the top, cooled everywhere but below;
/// or a body that nothing holds and nothing cools but the foundation.
template <int d>
struct PaperProblem {
  std::shared_ptr<const Mesh<d>> mesh;
  Problem<d> problem;
  Layout<d> layout;
  Operators<d> operators;
  ContactSurface<d> surface;
  VecHandle force, heat;

  static std::shared_ptr<const Mesh<d>> unit_box(int n) {
    std::array<int, d> counts;
    std::array<double, d> lengths;
    counts.fill(n);
    lengths.fill(1);
    return std::make_shared<Mesh<d>>(box<d>(counts, lengths, Diagonal::right));
  }
  static Problem<d> paper(std::shared_ptr<const Mesh<d>> mesh, double heating, int quadrature, bool held) {
    const Tensor2<d> id = Tensor2<d>::Identity();
    const Material<d> material{1, isotropic<d>(0.2, 0.9), isotropic<d>(10, 5), id, id, heating * id};
    std::vector<std::string> cooled{"top", "left", "right"};
    if (d == 3) cooled.insert(cooled.end(), {"front", "back"});
    const std::vector<std::string> clamped{"top"}, nothing;
    return {std::move(mesh),
            {material},
            {},
            held ? clamped : nothing,
            held ? cooled : nothing,
            {{"bottom", ContactLaw{{1e4}, {0.2}}, {quadrature}, 1}}};
  }
  explicit PaperProblem(int n, double heating = 1, int quadrature = 0, bool held = true)
      : mesh(unit_box(n)),
        problem(paper(mesh, heating, quadrature, held)),
        layout(PETSC_COMM_WORLD, mesh),
        operators(layout, problem),
        surface(layout, problem),
        force(layout.vector(d)),
        heat(layout.vector(1)) {
    Point<d> weight = -Point<d>::Unit(d - 1), left = 0.4 * Point<d>::Unit(d - 1), right = left;
    left[0] = 1.4;
    right[0] = -0.8;
    add(std::nullopt, weight, force);
    add("left", left, force);
    add("right", right, force);
    add(std::nullopt, Eigen::VectorXd::Ones(1), heat);
    add("bottom", Eigen::VectorXd::Constant(1, 10), heat);
  }
  void add(const std::optional<std::string>& part, const Eigen::VectorXd& value, Vec to) {
    const LoadQuadrature<d> rule(layout, part, 1);
    WARMSLIP_PETSC(VecAXPY(to, 1, rule.load(value.transpose().replicate(rule.positions().rows(), 1))));
  }
  Stepper<d> stepper(StepperOptions options) const { return {layout, problem, operators, surface, options}; }
  StepLoads loads() const { return {force, heat, Eigen::VectorXd::Zero(surface.points())}; }
  /// From rest, cold.
  void start(Stepper<d>& stepper) const {
    stepper.start(layout.vector(d), layout.vector(d), layout.vector(1), loads().gap);
  }
};

}  // namespace warmslip
