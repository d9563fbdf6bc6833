// P1 kernels on one simplex: pure functions of its vertices and a material tensor. Vector blocks are node-major,
// entry (i*d + a) belongs to node i and component a. Everything here is exact for constant coefficients.
#pragma once
#include "warmslip/mesh/simplex.hpp"

namespace warmslip {

template <int d>
using ScalarBlock = Eigen::Matrix<double, d + 1, d + 1>;
template <int d>
using VectorBlock = Eigen::Matrix<double, d*(d + 1), d*(d + 1)>;
template <int d>
using MixedBlock = Eigen::Matrix<double, d*(d + 1), d + 1>;
template <int d>
using StrainMatrix = Eigen::Matrix<double, mandel_size<d>, d*(d + 1)>;

/// eps(v) in Mandel form = strain_matrix * nodal values.
template <int d>
StrainMatrix<d> strain_matrix(const Simplex<d>& s);

/// (phi_j, phi_i): the consistent mass of a simplex with `nodes` vertices and measure `volume`.
template <int nodes>
Eigen::Matrix<double, nodes, nodes> mass(double volume) {
  using Block = Eigen::Matrix<double, nodes, nodes>;
  return volume / (nodes * (nodes + 1)) * (Block::Ones() + Block::Identity());
}

/// Its row sums on the diagonal: the mass by the vertex rule.
template <int nodes>
Eigen::Matrix<double, nodes, nodes> lumped_mass(double volume) {
  using Block = Eigen::Matrix<double, nodes, nodes>;
  return volume / nodes * Block::Identity();
}

/// The scalar mass on each of d components: (w, v).
template <int d>
VectorBlock<d> vector_mass(const Simplex<d>& s);

/// (C eps(phi_j), eps(phi_i)): a(.,.) with the elasticity tensor, b(.,.) with the viscosity tensor.
template <int d>
VectorBlock<d> strain_energy(const Simplex<d>& s, const Tensor4<d>& c);

/// (K grad phi_j, grad phi_i): d(.,.) with the conductivity.
template <int d>
ScalarBlock<d> conduction(const Simplex<d>& s, const Tensor2<d>& k);

/// (phi_j T, eps(phi_i)), rows the vector test functions: m(theta,v) with T the expansion tensor; its transpose is
/// e(w,eta) with T the heating tensor.
template <int d>
MixedBlock<d> coupling(const Simplex<d>& s, const Tensor2<d>& t);

}  // namespace warmslip
