// One simplex of a mesh: its vertices, its volume and the gradients of its barycentric coordinates.
#pragma once
#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

template <int d>
struct Simplex {
  Eigen::Matrix<double, d + 1, d> gradients;  ///< of the barycentric coordinates, 1/length
  double volume;                              ///< signed: negative when inverted
};

template <int d>
using Vertices = Eigen::Matrix<double, d + 1, d>;
/// Coordinates of the vertices of a cell, (d+1, d), length.
template <int d>
Vertices<d> vertices(const Mesh<d>& mesh, Eigen::Index cell);

/// Volume and gradients from the vertices; the volume is negative when the simplex is inverted.
template <int d>
Simplex<d> simplex(const Vertices<d>& x);

}  // namespace warmslip
