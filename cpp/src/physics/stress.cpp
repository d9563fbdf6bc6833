#include <stdexcept>
#include <string>

#include "warmslip/element.hpp"
#include "warmslip/problem.hpp"

namespace warmslip {

template <int d>
RealTable<d * d> stress(const Mesh<d>& mesh, const Material<d>& material, const RealTable<d>& u, const RealTable<d>& w,
                        const Eigen::VectorXd& theta) {
  if (u.rows() != mesh.nodes.rows() || w.rows() != mesh.nodes.rows() || theta.size() != mesh.nodes.rows())
    throw std::invalid_argument("u, w and theta need one row for each of the " + std::to_string(mesh.nodes.rows()) +
                                " nodes");
  RealTable<d * d> sigma(mesh.cells.rows(), d * d);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const StrainMatrix<d> b = strain_matrix<d>(simplex<d>(vertices(mesh, c)));
    Eigen::Matrix<double, d*(d + 1), 1> u_cell, w_cell;
    double mean = 0;
    for (int i = 0; i <= d; ++i) {
      const Index node = mesh.cells(c, i);
      u_cell.template segment<d>(i * d) = u.row(node).transpose();
      w_cell.template segment<d>(i * d) = w.row(node).transpose();
      mean += theta[node] / (d + 1);
    }
    const Mandel<d> mechanical = material.viscosity * (b * w_cell) + material.elasticity * (b * u_cell);
    const Tensor2<d> s = from_mandel<d>(mechanical) - mean * material.expansion;
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) sigma(c, i * d + j) = s(i, j);
  }
  return sigma;
}

template RealTable<4> stress<2>(const Mesh<2>&, const Material<2>&, const RealTable<2>&, const RealTable<2>&,
                                const Eigen::VectorXd&);
template RealTable<9> stress<3>(const Mesh<3>&, const Material<3>&, const RealTable<3>&, const RealTable<3>&,
                                const Eigen::VectorXd&);

}  // namespace warmslip
