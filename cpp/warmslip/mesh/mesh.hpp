// Simplicial meshes as values: nodes, cells and named boundary parts. No PETSc, no MPI.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "warmslip/mesh/tensor.hpp"

namespace warmslip {

using Index = std::int32_t;
template <int cols>
using IndexTable = Eigen::Matrix<Index, Eigen::Dynamic, cols, Eigen::RowMajor>;
template <int cols>
using RealTable = Eigen::Matrix<double, Eigen::Dynamic, cols, Eigen::RowMajor>;

/// Boundary facets of one part: `nodes` (facets, d) and the cell each facet belongs to.
template <int d>
struct Facets {
  IndexTable<d> nodes;
  std::vector<Index> cells;
};

template <int d>
struct Mesh {
  RealTable<d> nodes;                      ///< (nodes, d), length
  IndexTable<d + 1> cells;                 ///< (cells, d+1), positively oriented
  std::map<std::string, Facets<d>> parts;  ///< named parts of the boundary

  /// The part called `name`; std::invalid_argument names the parts there are when it is missing.
  const Facets<d>& part(const std::string& name) const;
};

/// A mesh from node and cell lists; `parts` names facets by their nodes. Throws std::invalid_argument with one sentence
/// naming the first faulty entry: non-finite or duplicate node, index out of range, inverted or flat cell, orphan node,
/// facet that is no boundary facet.
template <int d>
Mesh<d> mesh_from_lists(RealTable<d> nodes, IndexTable<d + 1> cells, const std::map<std::string, IndexTable<d>>& parts);

/// Some facets of a part.
template <int d>
Facets<d> selected(const Facets<d>& from, const std::vector<Eigen::Index>& rows);

/// All boundary facets (those of exactly one cell).
template <int d>
Facets<d> boundary(const IndexTable<d + 1>& cells);

/// Measure (length or area) times outward unit normal of facet `f`.
template <int d>
Point<d> area_normal(const Mesh<d>& mesh, const Facets<d>& facets, Eigen::Index f);

}  // namespace warmslip
