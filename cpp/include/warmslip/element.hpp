// P1 kernels on one simplex: pure functions of its vertices and a material tensor. Vector blocks are node-major,
// entry (i*d + a) belongs to node i and component a. Everything here is exact for constant coefficients.
#pragma once
#include "warmslip/mesh.hpp"

namespace warmslip {

template <int d>
struct Simplex {
  Eigen::Matrix<double, d + 1, d> gradients;  ///< of the barycentric coordinates, 1/length
  double volume;                              ///< signed: negative when inverted
};

template <int d>
using Vertices = Eigen::Matrix<double, d + 1, d>;
template <int d>
using ScalarBlock = Eigen::Matrix<double, d + 1, d + 1>;
template <int d>
using VectorBlock = Eigen::Matrix<double, d*(d + 1), d*(d + 1)>;
template <int d>
using MixedBlock = Eigen::Matrix<double, d*(d + 1), d + 1>;
template <int d>
using StrainMatrix = Eigen::Matrix<double, mandel_size<d>, d*(d + 1)>;

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

/// eps(v) in Mandel form = strain_matrix * nodal values.
template <int d>
StrainMatrix<d> strain_matrix(const Simplex<d>& s) {
  StrainMatrix<d> b = StrainMatrix<d>::Zero();
  const double half_root = 1 / std::sqrt(2.0);
  for (int i = 0; i <= d; ++i)
    for (int c = 0; c < mandel_size<d>; ++c) {
      const auto [p, q] = mandel_pair<d>(c);
      if (c < d) {
        b(c, i * d + p) = s.gradients(i, p);
      } else {
        b(c, i * d + p) = half_root * s.gradients(i, q);
        b(c, i * d + q) = half_root * s.gradients(i, p);
      }
    }
  return b;
}

/// (phi_j, phi_i): the consistent mass of a simplex of dimension `dim` and measure `volume`.
template <int nodes>
Eigen::Matrix<double, nodes, nodes> mass(double volume) {
  using Block = Eigen::Matrix<double, nodes, nodes>;
  return volume / (nodes * (nodes + 1)) * (Block::Ones() + Block::Identity());
}

/// (C eps(phi_j), eps(phi_i)): a(.,.) with the elasticity tensor, b(.,.) with the viscosity tensor.
template <int d>
VectorBlock<d> strain_energy(const Simplex<d>& s, const Tensor4<d>& c) {
  const StrainMatrix<d> b = strain_matrix<d>(s);
  return s.volume * b.transpose() * c * b;
}

/// (K grad phi_j, grad phi_i): d(.,.) with the conductivity.
template <int d>
ScalarBlock<d> conduction(const Simplex<d>& s, const Tensor2<d>& k) {
  return s.volume * s.gradients * k * s.gradients.transpose();
}

/// (phi_j T, eps(phi_i)), rows the vector test functions: m(theta,v) with T the expansion tensor; its transpose is
/// e(w,eta) with T the heating tensor.
template <int d>
MixedBlock<d> coupling(const Simplex<d>& s, const Tensor2<d>& t) {
  const Eigen::Matrix<double, d*(d + 1), 1> strain_work = s.volume / (d + 1) * strain_matrix<d>(s).transpose() * to_mandel<d>(t);
  return strain_work.replicate(1, d + 1);
}

}  // namespace warmslip
