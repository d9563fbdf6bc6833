#include "warmslip/mesh/mesh.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "warmslip/mesh/simplex.hpp"

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
Facets<d> selected(const Facets<d>& from, const std::vector<Eigen::Index>& rows) {
  Facets<d> facets;
  facets.nodes.resize(static_cast<Eigen::Index>(rows.size()), d);
  for (std::size_t f = 0; f < rows.size(); ++f) {
    facets.nodes.row(static_cast<Eigen::Index>(f)) = from.nodes.row(rows[f]);
    facets.cells.push_back(from.cells[static_cast<std::size_t>(rows[f])]);
  }
  return facets;
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
    mesh.parts[name] = selected(outer, rows);
  }
  return mesh;
}

#define WARMSLIP_INSTANTIATE(d)                                                       \
  template struct Mesh<d>;                                                            \
  template Facets<d> selected<d>(const Facets<d>&, const std::vector<Eigen::Index>&); \
  template Facets<d> boundary<d>(const IndexTable<d + 1>&);                           \
  template Point<d> area_normal<d>(const Mesh<d>&, const Facets<d>&, Eigen::Index);   \
  template Mesh<d> mesh_from_lists<d>(RealTable<d>, IndexTable<d + 1>, const std::map<std::string, IndexTable<d>>&);
WARMSLIP_INSTANTIATE(2)
WARMSLIP_INSTANTIATE(3)

}  // namespace warmslip
