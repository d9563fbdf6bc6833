#include "warmslip/mesh/simplex.hpp"

namespace warmslip {

template <int d>
Vertices<d> vertices(const Mesh<d>& mesh, Eigen::Index cell) {
  Vertices<d> x;
  for (int i = 0; i <= d; ++i) x.row(i) = mesh.nodes.row(mesh.cells(cell, i));
  return x;
}

template <int d>
Simplex<d> simplex(const Vertices<d>& x) {
  Tensor2<d> jacobian;
  for (int i = 0; i < d; ++i) jacobian.col(i) = (x.row(i + 1) - x.row(0)).transpose();
  Simplex<d> s;
  s.volume = jacobian.determinant() / (d == 2 ? 2.0 : 6.0);
  s.gradients.template bottomRows<d>() = jacobian.inverse();
  s.gradients.row(0) = -s.gradients.template bottomRows<d>().colwise().sum();
  return s;
}

template Vertices<2> vertices<2>(const Mesh<2>&, Eigen::Index);
template Vertices<3> vertices<3>(const Mesh<3>&, Eigen::Index);
template Simplex<2> simplex<2>(const Vertices<2>&);
template Simplex<3> simplex<3>(const Vertices<3>&);

}  // namespace warmslip
