// Quadrature on the reference simplex: Gauss-Jacobi points in collapsed coordinates (Stroud's conical product),
// positive weights, any number of points, any dimension.
#pragma once
#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

struct Rule {
  RealTable<Eigen::Dynamic> barycentric;  ///< (points, dim+1), dimensionless
  Eigen::VectorXd weights;                ///< (points), summing to 1: multiply by the cell's measure
};

/// n^dim points, exact for polynomials of degree 2n-1 on the simplex of dimension `dim` (1, 2 or 3).
Rule simplex_rule(int dim, int n);

/// The vertices with equal weights, exact for degree 1: what lumps a mass.
Rule vertex_rule(int dim);

}  // namespace warmslip
