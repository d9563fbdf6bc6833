#include <stdexcept>
#include <string>

#include "warmslip/element.hpp"
#include "warmslip/problem.hpp"

namespace warmslip {

template <int d>
RealTable<d * d> stress(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w,
                        const Eigen::VectorXd& theta) {
  const Mesh<d>& mesh = *problem.mesh;
  const bool elastic = problem.has(&Material<d>::elasticity), viscous = problem.has(&Material<d>::viscosity),
             expands = problem.has(&Material<d>::expansion);
  const auto missing = [&](bool needed, Eigen::Index rows) { return needed && rows != mesh.nodes.rows(); };
  if (missing(elastic, u.rows()) || missing(viscous, w.rows()) || missing(expands, theta.size()))
    throw std::invalid_argument("u, w and theta need one row for each of the " + std::to_string(mesh.nodes.rows()) +
                                " nodes");
  RealTable<d * d> sigma(mesh.cells.rows(), d * d);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const Material<d>& material = problem.material(static_cast<Index>(c));
    const StrainMatrix<d> b = strain_matrix<d>(simplex<d>(vertices(mesh, c)));
    Eigen::Matrix<double, d*(d + 1), 1> u_cell, w_cell;
    double mean = 0;
    for (int i = 0; i <= d; ++i) {
      const Index node = mesh.cells(c, i);
      if (elastic) u_cell.template segment<d>(i * d) = u.row(node).transpose();
      if (viscous) w_cell.template segment<d>(i * d) = w.row(node).transpose();
      if (expands) mean += theta[node] / (d + 1);
    }
    Mandel<d> mechanical = Mandel<d>::Zero();
    if (material.viscosity) mechanical += *material.viscosity * (b * w_cell);
    if (material.elasticity) mechanical += *material.elasticity * (b * u_cell);
    Tensor2<d> s = from_mandel<d>(mechanical);
    if (material.expansion) s -= mean * *material.expansion;
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) sigma(c, i * d + j) = s(i, j);
  }
  return sigma;
}

template RealTable<4> stress<2>(const Problem<2>&, const RealTable<2>&, const RealTable<2>&, const Eigen::VectorXd&);
template RealTable<9> stress<3>(const Problem<3>&, const RealTable<3>&, const RealTable<3>&, const Eigen::VectorXd&);

}  // namespace warmslip
