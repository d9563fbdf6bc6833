// A program outside the project: one step of an elastic square that hangs from its top and is drawn onto a foundation.
// With lambda = 0 the strain is uniform and the contact force is load stiffness / (2 mu + stiffness) = 0.9.
#include <cmath>
#include <cstdio>

#include "warmslip/mesh/box.hpp"
#include "warmslip/time/stepper.hpp"

using namespace warmslip;

int main(int argc, char** argv) {
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  double force = 0;
  {
    const auto mesh = std::make_shared<const Mesh<2>>(box<2>({8, 8}, {1, 1}, Diagonal::right));
    Material<2> material;
    material.elasticity = isotropic<2>(0, 5);
    const Problem<2> problem{mesh, {material}, {}, {"top"}, {}, {{"bottom", ContactLaw{{90}, {}}, {}}}};
    const Layout<2> layout(PETSC_COMM_WORLD, mesh);
    const Operators<2> operators(layout, problem);
    const ContactSurface<2> surface(layout, problem);
    const LoadQuadrature<2> bottom(layout, "bottom", 1);
    const VecHandle pull = bottom.load(Point<2>(0, -1).transpose().replicate(bottom.positions().rows(), 1));
    const Eigen::VectorXd gap = Eigen::VectorXd::Zero(surface.points());
    Stepper<2> stepper(layout, problem, operators, surface, {1.0, Coupling::staggered});
    stepper.start(layout.vector(2), layout.vector(2), nullptr, gap);
    force = stepper.advance({pull, nullptr, gap}).normal_force;
  }
  std::printf("contact force %.15g\n", force);
  PetscCall(PetscFinalize());
  return std::abs(force - 0.9) < 1e-12 ? 0 : 1;
}
