// Panels against dense solves, on factors with and without fill, definite and not.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <random>

#include "warmslip/la/supernodal.hpp"

using namespace warmslip;

namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// `block` unknowns a node of an n x n grid, five-point couplings; negative pivots in the last component when
/// `indefinite`.
Sparse grid_matrix(int n, int block, bool indefinite) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Triplet<double>> entries;
  const auto couple = [&](int a, int b) {
    for (int i = 0; i < block; ++i)
      for (int j = 0; j < block; ++j) {
        const double value = uniform(random);
        entries.emplace_back(a * block + i, b * block + j, value);
        entries.emplace_back(b * block + j, a * block + i, value);
      }
  };
  for (int node = 0; node < n * n; ++node) {
    if (node % n + 1 < n) couple(node, node + 1);
    if (node + n < n * n) couple(node, node + n);
    couple(node, node);
    for (int i = 0; i < block; ++i)
      entries.emplace_back(node * block + i, node * block + i, indefinite && i == block - 1 ? -12 * block : 12 * block);
  }
  const Eigen::Index size = Eigen::Index{n} * n * block;
  Sparse a(size, size);
  a.setFromTriplets(entries.begin(), entries.end());
  return a;
}

// Bytes of the panels.
double check(const Sparse& a) {
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> ldlt(a);
  REQUIRE(ldlt.info() == Eigen::Success);
  const Sparse strict = Sparse(ldlt.matrixL()).triangularView<Eigen::StrictlyLower>();
  const auto n = static_cast<std::size_t>(a.rows());
  std::vector<int> start, count, index;
  std::vector<double> value;
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    start.push_back(static_cast<int>(index.size()));
    index.push_back(static_cast<int>(j));
    value.push_back(ldlt.vectorD()[j]);
    for (Sparse::InnerIterator entry(strict, j); entry; ++entry) {
      index.push_back(static_cast<int>(entry.row()));
      value.push_back(entry.value());
    }
    count.push_back(static_cast<int>(index.size()) - start.back());
  }
  const Panels panels(n, start.data(), count.data(), index.data(), value.data());
  CHECK(panels.bytes() >= 8.0 * static_cast<double>(value.size()));
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(a.rows(), -1, 2);

  Eigen::VectorXd x = right;
  panels.forward(x.data());
  CHECK((x + strict * x - right).norm() <= 1e-12 * right.norm());
  const Eigen::VectorXd half = x;
  panels.backward(x.data());
  CHECK((ldlt.vectorD().cwiseProduct(x + strict.transpose() * x) - half).norm() <= 1e-12 * half.norm());
  CHECK((a * x - right).norm() <= 1e-12 * right.norm());
  if (a.rows() > 1000) return panels.bytes();
  const Eigen::VectorXd dense = Eigen::MatrixXd(a).partialPivLu().solve(right);
  CHECK((x - dense).norm() <= 1e-11 * dense.norm());
  return panels.bytes();
}

}  // namespace

TEST_CASE("panels substitute like a dense solve") {
  check(grid_matrix(1, 1, false));
  for (const int block : {1, 2, 3})
    for (const int n : {2, 5, 9}) check(grid_matrix(n, block, false));
  check(grid_matrix(6, 3, true));
  Sparse diagonal(7, 7);
  for (int i = 0; i < 7; ++i) diagonal.insert(i, i) = i % 2 ? -2.0 : 3.0;
  check(diagonal);
}

TEST_CASE("a factor beyond the caches is substituted like any other") {
  CHECK(check(grid_matrix(14, 8, false)) > 1e6);  // from where on it is fetched ahead
  CHECK(check(grid_matrix(16, 7, true)) > 1e6);
}
