// Second- and fourth-order symmetric tensors as plain Eigen values.
//
// Strains and stresses travel in Mandel form, (e11, e22, sqrt2 e12) or (e11, e22, e33, sqrt2 e23, sqrt2 e13, sqrt2
// e12), because there the double contraction of the paper is the ordinary dot product and a fourth-order tensor is a
// matrix.
#pragma once
#include <Eigen/Dense>
#include <array>

namespace warmslip {

template <int d>
inline constexpr int mandel_size = d*(d + 1) / 2;

template <int d>
using Point = Eigen::Matrix<double, d, 1>;
template <int d>
using Tensor2 = Eigen::Matrix<double, d, d>;
template <int d>
using Mandel = Eigen::Matrix<double, mandel_size<d>, 1>;
template <int d>
using Tensor4 = Eigen::Matrix<double, mandel_size<d>, mandel_size<d>>;

/// Row and column of Mandel component `c` (c >= d are the shears).
template <int d>
constexpr std::array<int, 2> mandel_pair(int c) {
  if (c < d) return {c, c};
  if constexpr (d == 2) return {0, 1};
  constexpr std::array<std::array<int, 2>, 3> shear{{{1, 2}, {0, 2}, {0, 1}}};
  return shear[static_cast<std::size_t>(c - d)];
}

/// Mandel form of the symmetric part of `t`.
template <int d>
Mandel<d> to_mandel(const Tensor2<d>& t) {
  Mandel<d> v;
  for (int c = 0; c < mandel_size<d>; ++c) {
    const auto [i, j] = mandel_pair<d>(c);
    v[c] = c < d ? t(i, i) : (t(i, j) + t(j, i)) / std::sqrt(2.0);
  }
  return v;
}

template <int d>
Tensor2<d> from_mandel(const Mandel<d>& v) {
  Tensor2<d> t;
  for (int c = 0; c < mandel_size<d>; ++c) {
    const auto [i, j] = mandel_pair<d>(c);
    t(i, j) = t(j, i) = c < d ? v[c] : v[c] / std::sqrt(2.0);
  }
  return t;
}

/// lambda tr(e) I + 2 mu e, the isotropic tensor of a Lame pair (lambda, mu), in units of stress or viscosity.
template <int d>
Tensor4<d> isotropic(double lambda, double mu) {
  Tensor4<d> c = 2 * mu * Tensor4<d>::Identity();
  c.template topLeftCorner<d, d>().array() += lambda;
  return c;
}

}  // namespace warmslip
