#include "warmslip/time/roundoff.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace warmslip {

double dot(Vec a, Vec b) {
  PetscReal value = 0;
  if (!a || !b) return 0;
  WARMSLIP_PETSC(VecDot(a, b, &value));
  return value;
}

double relative(double residual, double size) {
  return size > std::numeric_limits<double>::min() ? std::abs(residual) / size : residual == residual ? 0 : residual;
}

double largest_of(std::initializer_list<double> terms) {
  double largest = 0;
  for (const double term : terms) largest = std::max(largest, std::abs(term));
  return largest;
}

Eigen::VectorXd all_row_sizes(Mat a) {
  if (!a) return {};
  PetscInt begin, end;
  WARMSLIP_PETSC(MatGetOwnershipRange(a, &begin, &end));
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(end - begin);
  for (PetscInt row = begin; row < end; ++row) {
    PetscInt count;
    const PetscScalar* entries;
    WARMSLIP_PETSC(MatGetRow(a, row, &count, nullptr, &entries));
    for (PetscInt e = 0; e < count; ++e) sizes[row - begin] += std::abs(entries[e]);
    WARMSLIP_PETSC(MatRestoreRow(a, row, &count, nullptr, &entries));
  }
  return sizes;
}

Eigen::VectorXd row_sizes(Mat a) {
  if (!a) return {};
  const Eigen::VectorXd sizes = all_row_sizes(a);
  PetscInt block;
  WARMSLIP_PETSC(MatGetBlockSizes(a, &block, nullptr));
  return sizes.reshaped(block, sizes.size() / block).colwise().maxCoeff().transpose();
}

VecHandle row_sums(Mat a) {
  VecHandle ones, sums;
  WARMSLIP_PETSC(MatCreateVecs(a, ones.out(), sums.out()));
  WARMSLIP_PETSC(VecSet(ones, 1));
  WARMSLIP_PETSC(MatMult(a, ones, sums));
  return sums;
}

double largest_entry(Vec v) {
  PetscReal value = 0;
  if (v) WARMSLIP_PETSC(VecNorm(v, NORM_INFINITY, &value));
  return value;
}

double largest_entry(const Eigen::VectorXd& v) { return v.size() ? v.cwiseAbs().maxCoeff() : 0; }

}  // namespace warmslip
