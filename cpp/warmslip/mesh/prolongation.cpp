#include "warmslip/mesh/prolongation.hpp"

#include <stdexcept>

#include "warmslip/mesh/simplex.hpp"

namespace warmslip {
namespace {

// Cells of a mesh in the bins of a uniform grid, about one cell a bin.
template <int d>
class Bins {
 public:
  explicit Bins(const Mesh<d>& mesh) : mesh_(mesh) {
    low_ = mesh.nodes.colwise().minCoeff().transpose();
    const Point<d> high = mesh.nodes.colwise().maxCoeff().transpose();
    count_ = std::max(1, static_cast<int>(std::pow(static_cast<double>(mesh.cells.rows()), 1.0 / d)));
    width_ = (high - low_) * (1 + 1e-12) / count_;
    std::size_t total = 1;
    for (int a = 0; a < d; ++a) total *= static_cast<std::size_t>(count_);
    cells_.resize(total);
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
      const Vertices<d> x = vertices(mesh, c);
      const Bin from = bin(x.colwise().minCoeff().transpose()), to = bin(x.colwise().maxCoeff().transpose());
      for (Bin at = from;;) {
        cells_[flat(at)].push_back(c);
        int a = 0;
        while (a < d && ++at[a] > to[a]) at[a] = from[a], ++a;
        if (a == d) break;
      }
    }
  }

  /// The cell that holds x, or -1.
  Eigen::Index locate(const Point<d>& x) const {
    for (const Eigen::Index c : cells_[flat(bin(x))])
      if (barycentric(c, x).minCoeff() > -1e-10) return c;
    return -1;
  }

  Eigen::Matrix<double, d + 1, 1> barycentric(Eigen::Index cell, const Point<d>& x) const {
    const Vertices<d> v = vertices(mesh_, cell);
    Eigen::Matrix<double, d + 1, 1> b = simplex<d>(v).gradients * (x - v.row(0).transpose());
    b[0] += 1;
    return b;
  }

 private:
  using Bin = Eigen::Matrix<int, d, 1>;
  Bin bin(const Point<d>& x) const {
    return ((x - low_).array() / width_.array()).template cast<int>().cwiseMax(0).cwiseMin(count_ - 1).matrix();
  }
  std::size_t flat(const Bin& at) const {
    std::size_t index = 0;
    for (int a = d - 1; a >= 0; --a) index = index * static_cast<std::size_t>(count_) + static_cast<std::size_t>(at[a]);
    return index;
  }

  const Mesh<d>& mesh_;
  Point<d> low_, width_;
  int count_;
  std::vector<std::vector<Eigen::Index>> cells_;
};

}  // namespace

template <int d>
Prolongation prolongation(const Mesh<d>& coarse, const Mesh<d>& fine) {
  const Bins<d> bins(coarse);
  std::vector<bool> done(static_cast<std::size_t>(fine.nodes.rows()), false);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < fine.cells.rows(); ++f) {
    const Vertices<d> x = vertices(fine, f);
    const Eigen::Index home = bins.locate(x.colwise().mean().transpose());
    for (int i = 0; i <= d; ++i) {
      // the whole fine cell must lie in the coarse cell of its centroid: that is what nested means
      const auto weights = home < 0 ? Eigen::Matrix<double, d + 1, 1>::Constant(-1).eval()
                                    : bins.barycentric(home, x.row(i).transpose()).eval();
      if (weights.minCoeff() < -1e-9)
        throw std::invalid_argument("the meshes are not nested: fine cell " + std::to_string(f) +
                                    " does not lie in one coarse cell");
      const Index node = fine.cells(f, i);
      if (done[static_cast<std::size_t>(node)]) continue;
      done[static_cast<std::size_t>(node)] = true;
      for (int j = 0; j <= d; ++j)
        if (std::abs(weights[j]) > 1e-12) entries.emplace_back(node, coarse.cells(home, j), weights[j]);
    }
  }
  Prolongation p(fine.nodes.rows(), coarse.nodes.rows());
  p.setFromTriplets(entries.begin(), entries.end());
  return p;
}

template Prolongation prolongation<2>(const Mesh<2>&, const Mesh<2>&);
template Prolongation prolongation<3>(const Mesh<3>&, const Mesh<3>&);

}  // namespace warmslip
