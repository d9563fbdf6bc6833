// Sizes of the terms of a balance, against which its residual is judged.
#pragma once
#include <array>
#include <initializer_list>

#include "warmslip/fem/layout.hpp"

namespace warmslip {

/// a . b over all ranks; 0 where either is not there.
double dot(Vec a, Vec b);

/// (a1 - a0) . (b1 - b0) without forming the differences.
template <int d>
double dot_of_changes(const Layout<d>& layout, Vec a1, Vec a0, Vec b1, Vec b0) {
  if (!b1) return 0;
  Values x1(a1), x0(a0), y1(b1), y0(b0);
  return layout.sum(((*x1) - (*x0)).dot((*y1) - (*y0)));
}

/// |residual| against the size of what was added; numbers whose squares are lost to underflow count as none.
double relative(double residual, double size);

double largest_of(std::initializer_list<double> terms);

/// Sum of |entries| of every row that this rank owns. Empty for no matrix.
Eigen::VectorXd all_row_sizes(Mat a);

/// The largest of them for every node.
Eigen::VectorXd row_sizes(Mat a);

/// Sums of the rows of a matrix that may be known by its products alone (collective).
VecHandle row_sums(Mat a);

/// Largest of some sizes over all ranks.
template <std::size_t count>
std::array<double, count> over_ranks(MPI_Comm comm, std::array<double, count> largest) {
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), static_cast<int>(count), MPI_DOUBLE, MPI_MAX, comm);
  return largest;
}

/// The largest magnitude of an entry (of a distributed vector: collective); 0 of none.
double largest_entry(Vec v);
double largest_entry(const Eigen::VectorXd& v);

}  // namespace warmslip
