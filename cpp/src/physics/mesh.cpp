#include "warmslip/mesh.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "warmslip/element.hpp"

namespace warmslip {
namespace {

[[noreturn]] void refuse(const std::string& sentence) { throw std::invalid_argument(sentence); }

template <int d>
using FacetKey = std::array<Index, d>;

template <int d>
FacetKey<d> key_of(const Eigen::Ref<const Eigen::Matrix<Index, 1, d>>& nodes) {
  FacetKey<d> key;
  std::copy_n(nodes.data(), d, key.begin());
  std::sort(key.begin(), key.end());
  return key;
}

template <int d>
Eigen::Matrix<Index, 1, d> facet_of(const IndexTable<d + 1>& cells, Eigen::Index cell, int opposite) {
  Eigen::Matrix<Index, 1, d> nodes;
  for (int i = 0, j = 0; i <= d; ++i)
    if (i != opposite) nodes[j++] = cells(cell, i);
  return nodes;
}

template <int d>
Facets<d> take(const Facets<d>& from, const std::vector<Eigen::Index>& rows) {
  Facets<d> facets;
  facets.nodes.resize(static_cast<Eigen::Index>(rows.size()), d);
  for (std::size_t f = 0; f < rows.size(); ++f) {
    facets.nodes.row(static_cast<Eigen::Index>(f)) = from.nodes.row(rows[f]);
    facets.cells.push_back(from.cells[static_cast<std::size_t>(rows[f])]);
  }
  return facets;
}

// Kuhn's cut of a brick: one simplex for each order in which a path climbs from the lowest to the highest corner.
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

template <int d>
void check_nodes(const RealTable<d>& nodes) {
  for (Eigen::Index i = 0; i < nodes.rows(); ++i)
    if (!nodes.row(i).allFinite()) refuse("node " + std::to_string(i) + " has a coordinate that is not finite");
  std::vector<Eigen::Index> order(static_cast<std::size_t>(nodes.rows()));
  std::iota(order.begin(), order.end(), 0);
  const auto row_less = [&](Eigen::Index a, Eigen::Index b) {
    return std::lexicographical_compare(nodes.row(a).begin(), nodes.row(a).end(), nodes.row(b).begin(),
                                        nodes.row(b).end());
  };
  std::sort(order.begin(), order.end(), row_less);
  for (std::size_t i = 1; i < order.size(); ++i)
    if (nodes.row(order[i]) == nodes.row(order[i - 1])) {
      const auto [low, high] = std::minmax(order[i], order[i - 1]);
      refuse("nodes " + std::to_string(low) + " and " + std::to_string(high) + " are at the same place; merge them");
    }
}

template <int d>
void check_cells(const Mesh<d>& mesh) {
  std::vector<bool> used(static_cast<std::size_t>(mesh.nodes.rows()), false);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    for (int i = 0; i <= d; ++i) {
      const Index node = mesh.cells(c, i);
      if (node < 0 || node >= mesh.nodes.rows())
        refuse("cell " + std::to_string(c) + " names node " + std::to_string(node) + ", but the mesh has nodes 0 to " +
               std::to_string(mesh.nodes.rows() - 1));
      used[static_cast<std::size_t>(node)] = true;
    }
    const Vertices<d> x = vertices(mesh, c);
    const double size = (x.rowwise() - x.row(0)).rowwise().norm().maxCoeff();
    const double volume = simplex<d>(x).volume;
    if (!(volume > 1e-14 * std::pow(size, d)))
      refuse("cell " + std::to_string(c) +
             (volume < 0 ? " is inverted; swap two of its nodes" : " is flat; remove it"));
  }
  const auto orphan = std::find(used.begin(), used.end(), false);
  if (orphan != used.end()) refuse("node " + std::to_string(orphan - used.begin()) + " belongs to no cell; remove it");
}

}  // namespace

template <int d>
const Facets<d>& Mesh<d>::part(const std::string& name) const {
  if (const auto found = parts.find(name); found != parts.end()) return found->second;
  std::ostringstream names;
  for (const auto& [other, facets] : parts) names << (names.tellp() > 0 ? ", " : "") << other;
  refuse("the mesh has no boundary part '" + name + "'; its parts are: " + names.str());
}

template <int d>
Facets<d> boundary(const IndexTable<d + 1>& cells) {
  std::vector<std::pair<FacetKey<d>, std::pair<Index, int>>> all;
  all.reserve(static_cast<std::size_t>(cells.rows()) * (d + 1));
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    for (int i = 0; i <= d; ++i)
      all.emplace_back(key_of<d>(facet_of<d>(cells, c, i)), std::pair(static_cast<Index>(c), i));
  std::sort(all.begin(), all.end());
  std::vector<std::pair<Index, int>> outer;
  for (std::size_t f = 0; f < all.size();) {
    std::size_t next = f + 1;
    while (next < all.size() && all[next].first == all[f].first) ++next;
    if (next - f == 1) outer.push_back(all[f].second);
    if (next - f > 2) refuse("more than two cells share a facet of cell " + std::to_string(all[f].second.first));
    f = next;
  }
  std::sort(outer.begin(), outer.end());
  Facets<d> facets;
  facets.nodes.resize(static_cast<Eigen::Index>(outer.size()), d);
  for (std::size_t f = 0; f < outer.size(); ++f) {
    facets.nodes.row(static_cast<Eigen::Index>(f)) = facet_of<d>(cells, outer[f].first, outer[f].second);
    facets.cells.push_back(outer[f].first);
  }
  return facets;
}

template <int d>
Point<d> area_normal(const Mesh<d>& mesh, const Facets<d>& facets, Eigen::Index f) {
  const auto nodes = facets.nodes.row(f);
  const Point<d> origin = mesh.nodes.row(nodes[0]).transpose();
  Point<d> normal;
  const Point<d> first = mesh.nodes.row(nodes[1]).transpose() - origin;
  if constexpr (d == 2) {
    normal << first[1], -first[0];
  } else {
    normal = 0.5 * first.cross(Point<d>(mesh.nodes.row(nodes[2]).transpose() - origin));
  }
  const Point<d> inside = vertices(mesh, facets.cells[static_cast<std::size_t>(f)]).colwise().mean().transpose();
  return normal.dot(inside - origin) > 0 ? Point<d>(-normal) : normal;
}

template <int d>
Mesh<d> box(const std::array<int, d>& counts, const std::array<double, d>& lengths, Diagonal diagonal) {
  for (int a = 0; a < d; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    if (counts[axis] < 1) refuse("a box needs at least one brick along each axis");
    if (!(lengths[axis] > 0)) refuse("a box needs positive lengths");
  }
  if (d == 3 && diagonal == Diagonal::crisscross) refuse("a criss-cross mesh exists for d = 2 only; use right or left");
  std::array<Index, d + 1> stride{1};
  Eigen::Index bricks = 1;
  for (std::size_t a = 0; a < d; ++a) {
    stride[a + 1] = stride[a] * (counts[a] + 1);
    bricks *= counts[a];
  }
  const bool centred = diagonal == Diagonal::crisscross;
  const bool mirrored = diagonal == Diagonal::left;
  const auto simplices = kuhn_simplices<d>();
  const auto per_brick = centred ? 4 : static_cast<Eigen::Index>(simplices.size());

  Mesh<d> mesh;
  mesh.nodes.resize(stride[d] + (centred ? bricks : 0), d);
  for (Index i = 0; i < stride[d]; ++i)
    for (std::size_t a = 0; a < d; ++a)
      mesh.nodes(i, static_cast<int>(a)) = lengths[a] * ((i / stride[a]) % (counts[a] + 1)) / counts[a];

  mesh.cells.resize(bricks * per_brick, d + 1);
  for (Eigen::Index brick = 0, cell = 0; brick < bricks; ++brick) {
    std::array<Index, d> at;
    for (Eigen::Index a = 0, rest = brick; a < d; rest /= counts[static_cast<std::size_t>(a)], ++a)
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
      const auto centre = static_cast<Index>(stride[d] + brick);
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
      mesh.parts[names[a][high]] = take(outer, rows);
    }
  return mesh;
}

template <int d>
Mesh<d> mesh_from_lists(RealTable<d> nodes, IndexTable<d + 1> cells,
                        const std::map<std::string, IndexTable<d>>& parts) {
  if (cells.rows() == 0) refuse("the mesh has no cells");
  check_nodes<d>(nodes);
  Mesh<d> mesh{std::move(nodes), std::move(cells), {}};
  check_cells(mesh);
  const Facets<d> outer = boundary<d>(mesh.cells);
  std::map<FacetKey<d>, Eigen::Index> known;
  for (Eigen::Index f = 0; f < outer.nodes.rows(); ++f) known[key_of<d>(outer.nodes.row(f))] = f;
  for (const auto& [name, facets] : parts) {
    if (facets.rows() == 0) refuse("boundary part '" + name + "' has no facets");
    std::vector<Eigen::Index> rows;
    for (Eigen::Index f = 0; f < facets.rows(); ++f) {
      const auto found = known.find(key_of<d>(facets.row(f)));
      if (found == known.end())
        refuse("facet " + std::to_string(f) + " of part '" + name + "' is not a boundary facet of the mesh");
      rows.push_back(found->second);
    }
    mesh.parts[name] = take(outer, rows);
  }
  return mesh;
}

#define WARMSLIP_INSTANTIATE(d)                                                               \
  template struct Mesh<d>;                                                                    \
  template Facets<d> boundary<d>(const IndexTable<d + 1>&);                                   \
  template Point<d> area_normal<d>(const Mesh<d>&, const Facets<d>&, Eigen::Index);           \
  template Mesh<d> box<d>(const std::array<int, d>&, const std::array<double, d>&, Diagonal); \
  template Mesh<d> mesh_from_lists<d>(RealTable<d>, IndexTable<d + 1>, const std::map<std::string, IndexTable<d>>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
