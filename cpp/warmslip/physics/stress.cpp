#include <algorithm>
#include <stdexcept>
#include <string>

#include "warmslip/physics/p1.hpp"
#include "warmslip/physics/problem.hpp"

namespace warmslip {
namespace {

// Calls visit(cell, material, eps(u), eps(w), theta - reference), each zero where the problem has no such field.
template <int d, class Visit>
void at_centroids(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w, const Eigen::VectorXd& theta,
                  Visit&& visit) {
  const Mesh<d>& mesh = *problem.mesh;
  const bool elastic = problem.has(&Material<d>::elasticity), viscous = problem.has(&Material<d>::viscosity),
             expands = problem.has(&Material<d>::expansion);
  const auto missing = [&](bool needed, Eigen::Index rows) { return needed && rows != mesh.nodes.rows(); };
  if (missing(elastic, u.rows()) || missing(viscous, w.rows()) || missing(expands, theta.size()))
    throw std::invalid_argument("u, w and theta need one row for each of the " + std::to_string(mesh.nodes.rows()) +
                                " nodes");
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const Material<d>& material = problem.material(static_cast<Index>(c));
    const StrainMatrix<d> b = strain_matrix<d>(simplex<d>(vertices(mesh, c)));
    using Nodal = Eigen::Matrix<double, d*(d + 1), 1>;
    Nodal u_cell = Nodal::Zero(), w_cell = Nodal::Zero();
    double mean = 0;
    for (int i = 0; i <= d; ++i) {
      const Index node = mesh.cells(c, i);
      if (elastic) u_cell.template segment<d>(i * d) = u.row(node).transpose();
      if (viscous) w_cell.template segment<d>(i * d) = w.row(node).transpose();
      if (expands) mean += (theta[node] - material.reference) / (d + 1);
    }
    visit(c, material, Mandel<d>(b * u_cell), Mandel<d>(b * w_cell), mean);
  }
}

}  // namespace

template <int d>
RealTable<d * d> stress(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w,
                        const Eigen::VectorXd& theta) {
  RealTable<d * d> sigma(problem.mesh->cells.rows(), d * d);
  at_centroids(
      problem, u, w, theta,
      [&](Eigen::Index c, const Material<d>& material, const Mandel<d>& strain, const Mandel<d>& rate, double warmer) {
        Mandel<d> mechanical = Mandel<d>::Zero();
        if (material.viscosity) mechanical += *material.viscosity * rate;
        if (material.elasticity) mechanical += *material.elasticity * strain;
        Tensor2<d> s = from_mandel<d>(mechanical);
        if (material.expansion) s -= warmer * *material.expansion;
        for (int i = 0; i < d; ++i)
          for (int j = 0; j < d; ++j) sigma(c, i * d + j) = s(i, j);
      });
  return sigma;
}

template <int d>
Eigen::VectorXd stress_out_of_plane(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w,
                                    const Eigen::VectorXd& theta) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(problem.mesh->cells.rows());
  if constexpr (d == 2)
    at_centroids(problem, u, w, theta,
                 [&](Eigen::Index c, const Material<d>& material, const Mandel<d>& strain, const Mandel<d>& rate,
                     double warmer) {
                   const OutOfPlane& out = material.out_of_plane;
                   sigma[c] = out.elastic * strain.template head<d>().sum() +
                              out.viscous * rate.template head<d>().sum() - out.expansion * warmer;
                 });
  return sigma;
}

template <int d>
double largest_strain(const Mesh<d>& mesh, const RealTable<d>& u) {
  if (u.rows() != mesh.nodes.rows())
    throw std::invalid_argument("u needs one row for each of the " + std::to_string(mesh.nodes.rows()) + " nodes");
  double largest = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const Simplex<d> s = simplex<d>(vertices(mesh, c));
    Tensor2<d> gradient = Tensor2<d>::Zero();
    for (int i = 0; i <= d; ++i) gradient += u.row(mesh.cells(c, i)).transpose() * s.gradients.row(i);
    const Tensor2<d> strain = (gradient + gradient.transpose()) / 2;
    if (strain.squaredNorm() <= largest * largest) continue;  // which no principal strain exceeds
    Eigen::SelfAdjointEigenSolver<Tensor2<d>> solver;
    solver.computeDirect(strain, Eigen::EigenvaluesOnly);
    largest = std::max(largest, solver.eigenvalues().cwiseAbs().maxCoeff());
  }
  return largest;
}

#define WARMSLIP_INSTANTIATE(d)                                                                                \
  template RealTable<d * d> stress<d>(const Problem<d>&, const RealTable<d>&, const RealTable<d>&,             \
                                      const Eigen::VectorXd&);                                                 \
  template Eigen::VectorXd stress_out_of_plane<d>(const Problem<d>&, const RealTable<d>&, const RealTable<d>&, \
                                                  const Eigen::VectorXd&);                                     \
  template double largest_strain<d>(const Mesh<d>&, const RealTable<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
