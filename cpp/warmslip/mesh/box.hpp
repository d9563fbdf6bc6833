// Structured meshes of boxes.
#pragma once
#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

enum class Diagonal { right, left, crisscross };

/// The box [0,L1] x .. x [0,Ld] in counts[0] x .. x counts[d-1] grid cells, each cut along its diagonal (0..0)-(1..1)
/// for `right` (Kuhn's cut, nested under halving in any d), its mirror image in x for `left`, or both for `crisscross`
/// (d = 2). Parts: left, right (x), bottom, top (the last axis), and front, back (y) for d = 3.
template <int d>
Mesh<d> box(const std::array<int, d>& counts, const std::array<double, d>& lengths, Diagonal diagonal);

}  // namespace warmslip
