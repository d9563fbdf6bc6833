#include "warmslip/mesh/box.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>

namespace warmslip {
namespace {

[[noreturn]] void refuse(const char* sentence) { throw std::invalid_argument(sentence); }

// Kuhn's cut of a grid cell: one simplex for each order in which a path climbs from the lowest to the highest corner.
template <int d>
std::vector<std::array<int, d + 1>> kuhn_simplices() {
  std::array<int, d> order;
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::array<int, d + 1>> all;
  bool even = true;
  do {
    std::array<int, d + 1> corners{};
    for (int i = 0; i < d; ++i)
      corners[static_cast<std::size_t>(i) + 1] =
          corners[static_cast<std::size_t>(i)] | (1 << order[static_cast<std::size_t>(i)]);
    int inversions = 0;
    for (int i = 0; i < d; ++i)
      for (int j = i + 1; j < d; ++j)
        inversions += order[static_cast<std::size_t>(i)] > order[static_cast<std::size_t>(j)];
    even = inversions % 2 == 0;
    if (!even) std::swap(corners[d - 1], corners[d]);
    all.push_back(corners);
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

}  // namespace

template <int d>
Mesh<d> box(const std::array<int, d>& counts, const std::array<double, d>& lengths, Diagonal diagonal) {
  for (int a = 0; a < d; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    if (counts[axis] < 1) refuse("a box needs at least one cell along each axis");
    if (!(lengths[axis] > 0)) refuse("a box needs positive lengths");
  }
  if (d == 3 && diagonal == Diagonal::crisscross) refuse("a criss-cross mesh exists for d = 2 only; use right or left");
  std::array<Index, d + 1> stride{1};
  Eigen::Index grid_cells = 1;
  for (std::size_t a = 0; a < d; ++a) {
    stride[a + 1] = stride[a] * (counts[a] + 1);
    grid_cells *= counts[a];
  }
  const bool centred = diagonal == Diagonal::crisscross;
  const bool mirrored = diagonal == Diagonal::left;
  const auto simplices = kuhn_simplices<d>();
  const auto per_grid_cell = centred ? 4 : static_cast<Eigen::Index>(simplices.size());

  Mesh<d> mesh;
  mesh.nodes.resize(stride[d] + (centred ? grid_cells : 0), d);
  for (Index i = 0; i < stride[d]; ++i)
    for (std::size_t a = 0; a < d; ++a)
      mesh.nodes(i, static_cast<int>(a)) = lengths[a] * ((i / stride[a]) % (counts[a] + 1)) / counts[a];

  mesh.cells.resize(grid_cells * per_grid_cell, d + 1);
  for (Eigen::Index grid_cell = 0, cell = 0; grid_cell < grid_cells; ++grid_cell) {
    std::array<Index, d> at;
    for (Eigen::Index a = 0, rest = grid_cell; a < d; rest /= counts[static_cast<std::size_t>(a)], ++a)
      at[static_cast<std::size_t>(a)] = static_cast<Index>(rest % counts[static_cast<std::size_t>(a)]);
    const auto corner = [&](int bits) {
      Index node = 0;
      for (int a = 0; a < d; ++a) {
        const int up = (bits >> a & 1) ^ (a == 0 && mirrored);
        node += (at[static_cast<std::size_t>(a)] + up) * stride[static_cast<std::size_t>(a)];
      }
      return node;
    };
    if (centred) {
      const auto centre = static_cast<Index>(stride[d] + grid_cell);
      for (int a = 0; a < d; ++a)
        mesh.nodes(centre, a) = lengths[static_cast<std::size_t>(a)] * (at[static_cast<std::size_t>(a)] + 0.5) /
                                counts[static_cast<std::size_t>(a)];
      constexpr std::array<int, 5> ring{0, 1, 3, 2, 0};
      for (std::size_t side = 0; side < 4; ++side, ++cell) {
        mesh.cells(cell, 0) = corner(ring[side]);
        mesh.cells(cell, 1) = corner(ring[side + 1]);
        mesh.cells(cell, 2) = centre;
      }
    } else {
      for (const auto& corners : simplices) {
        for (int i = 0; i <= d; ++i) mesh.cells(cell, i) = corner(corners[static_cast<std::size_t>(i)]);
        if (mirrored) std::swap(mesh.cells(cell, d - 1), mesh.cells(cell, d));
        ++cell;
      }
    }
  }

  const Facets<d> outer = boundary<d>(mesh.cells);
  const std::array<std::array<const char*, 2>, 3> names =
      d == 2 ? std::array<std::array<const char*, 2>, 3>{{{"left", "right"}, {"bottom", "top"}, {"", ""}}}
             : std::array<std::array<const char*, 2>, 3>{{{"left", "right"}, {"front", "back"}, {"bottom", "top"}}};
  for (std::size_t a = 0; a < d; ++a)
    for (std::size_t high = 0; high < 2; ++high) {
      std::vector<Eigen::Index> rows;
      for (Eigen::Index f = 0; f < outer.nodes.rows(); ++f) {
        bool on = true;
        for (int i = 0; i < d; ++i) {
          const Index node = outer.nodes(f, i);
          on = on && node < stride[d] && (node / stride[a]) % (counts[a] + 1) == (high ? counts[a] : 0);
        }
        if (on) rows.push_back(f);
      }
      mesh.parts[names[a][high]] = selected(outer, rows);
    }
  return mesh;
}

template Mesh<2> box<2>(const std::array<int, 2>&, const std::array<double, 2>&, Diagonal);
template Mesh<3> box<3>(const std::array<int, 3>&, const std::array<double, 3>&, Diagonal);

}  // namespace warmslip
