#include "warmslip/physics/p1.hpp"

namespace warmslip {

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

template <int d>
VectorBlock<d> vector_mass(const Simplex<d>& s) {
  const ScalarBlock<d> m = mass<d + 1>(s.volume);
  VectorBlock<d> block = VectorBlock<d>::Zero();
  for (int i = 0; i <= d; ++i)
    for (int j = 0; j <= d; ++j)
      for (int a = 0; a < d; ++a) block(i * d + a, j * d + a) = m(i, j);
  return block;
}

template <int d>
VectorBlock<d> strain_energy(const Simplex<d>& s, const Tensor4<d>& c) {
  const StrainMatrix<d> b = strain_matrix<d>(s), cb = s.volume * (c * b);
  return b.transpose() * cb;
}

template <int d>
ScalarBlock<d> conduction(const Simplex<d>& s, const Tensor2<d>& k) {
  const Eigen::Matrix<double, d + 1, d> flux = s.volume * (s.gradients * k);
  return flux * s.gradients.transpose();
}

template <int d>
MixedBlock<d> coupling(const Simplex<d>& s, const Tensor2<d>& t) {
  const Eigen::Matrix<double, d*(d + 1), 1> strain_work =
      s.volume / (d + 1) * (strain_matrix<d>(s).transpose() * to_mandel<d>(t));
  return strain_work.replicate(1, d + 1);
}

#define WARMSLIP_INSTANTIATE(d)                                                   \
  template StrainMatrix<d> strain_matrix<d>(const Simplex<d>&);                   \
  template VectorBlock<d> vector_mass<d>(const Simplex<d>&);                      \
  template VectorBlock<d> strain_energy<d>(const Simplex<d>&, const Tensor4<d>&); \
  template ScalarBlock<d> conduction<d>(const Simplex<d>&, const Tensor2<d>&);    \
  template MixedBlock<d> coupling<d>(const Simplex<d>&, const Tensor2<d>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
