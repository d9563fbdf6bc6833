// Exact prolongation of P1 functions between nested meshes.
#pragma once
#include <Eigen/Sparse>

#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

using Prolongation = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// The matrix (fine nodes, coarse nodes) that represents every P1 function of `coarse` on `fine`, to round-off.
/// Throws std::invalid_argument naming a fine cell that crosses a coarse facet when the meshes are not nested.
template <int d>
Prolongation prolongation(const Mesh<d>& coarse, const Mesh<d>& fine);

}  // namespace warmslip
