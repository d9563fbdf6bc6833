// Box meshes, meshes from lists and what they refuse, prolongation between nested meshes.
#include <doctest/doctest.h>

#include "warmslip/mesh/box.hpp"
#include "warmslip/mesh/prolongation.hpp"
#include "warmslip/physics/p1.hpp"

using namespace warmslip;

namespace {

/// Volume by cells, area by facets, closedness of the boundary and the place of every part.
template <int d>
void check_box(const std::array<int, d>& counts, const std::array<double, d>& lengths, Diagonal diagonal) {
  const Mesh<d> mesh = box<d>(counts, lengths, diagonal);
  double volume = 0, least = 1e300, exact = 1;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const double one = simplex<d>(vertices(mesh, c)).volume;
    volume += one;
    least = std::min(least, one);
  }
  for (const double length : lengths) exact *= length;
  CHECK(least > 0);
  CHECK(volume == doctest::Approx(exact).epsilon(1e-13));

  const std::array<std::array<const char*, 2>, 3> names =
      d == 2 ? std::array<std::array<const char*, 2>, 3>{{{"left", "right"}, {"bottom", "top"}, {"", ""}}}
             : std::array<std::array<const char*, 2>, 3>{{{"left", "right"}, {"front", "back"}, {"bottom", "top"}}};
  CHECK(mesh.parts.size() == 2 * d);
  Eigen::Index facets = 0;
  for (std::size_t a = 0; a < d; ++a)
    for (std::size_t high = 0; high < 2; ++high) {
      const Facets<d>& part = mesh.part(names[a][high]);
      facets += part.nodes.rows();
      Point<d> sum = Point<d>::Zero();
      double worst = 0;
      for (Eigen::Index f = 0; f < part.nodes.rows(); ++f) {
        sum += area_normal(mesh, part, f);
        for (int i = 0; i < d; ++i)
          worst =
              std::max(worst, std::abs(mesh.nodes(part.nodes(f, i), static_cast<int>(a)) - (high ? lengths[a] : 0.0)));
      }
      CHECK(worst <= 1e-14);
      const Point<d> outward = (high ? 1 : -1) * exact / lengths[a] * Point<d>::Unit(static_cast<int>(a));
      CHECK((sum - outward).norm() <= 1e-13 * exact / lengths[a]);
    }
  CHECK(facets == boundary<d>(mesh.cells).nodes.rows());
  // what a box is made of is accepted as lists
  std::map<std::string, IndexTable<d>> parts;
  for (const auto& [name, part] : mesh.parts) parts[name] = part.nodes;
  CHECK(mesh_from_lists<d>(mesh.nodes, mesh.cells, parts).part("top").cells == mesh.part("top").cells);
}

/// Two triangles on the unit square.
struct Lists {
  RealTable<2> nodes{4, 2};
  IndexTable<3> cells{2, 3};
  std::map<std::string, IndexTable<2>> parts;
  Lists() {
    nodes << 0, 0, 1, 0, 0, 1, 1, 1;
    cells << 0, 1, 3, 0, 3, 2;
    parts["floor"] = (IndexTable<2>(1, 2) << 1, 0).finished();
  }
  /// The sentence it is refused with, "" when it is not.
  std::string refusal() const {
    try {
      mesh_from_lists<2>(nodes, cells, parts);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  }
  bool names(const std::string& words) const { return refusal().find(words) != std::string::npos; }
};

template <int d>
void check_prolongation(const Mesh<d>& coarse, const Mesh<d>& fine) {
  const Prolongation p = prolongation<d>(coarse, fine);
  const Point<d> slope = Point<d>::LinSpaced(1, 2.5);
  CHECK((p * (coarse.nodes * slope) - fine.nodes * slope).norm() <= 1e-13 * (fine.nodes * slope).norm());
  CHECK((p * Eigen::VectorXd::Ones(coarse.nodes.rows()) - Eigen::VectorXd::Ones(fine.nodes.rows())).norm() <= 1e-12);
  // a hat of the coarse mesh keeps its mass: the prolonged function is the same function
  const auto total = [](const Mesh<d>& mesh, const Eigen::VectorXd& v) {
    double square = 0;
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
      Eigen::Matrix<double, d + 1, 1> own;
      for (int i = 0; i <= d; ++i) own[i] = v[mesh.cells(c, i)];
      square += own.dot(mass<d + 1>(simplex<d>(vertices(mesh, c)).volume) * own);
    }
    return square;
  };
  const Eigen::VectorXd hat = Eigen::VectorXd::Unit(coarse.nodes.rows(), coarse.nodes.rows() / 2);
  CHECK(total(fine, p * hat) == doctest::Approx(total(coarse, hat)).epsilon(1e-13));
}

}  // namespace

TEST_CASE("boxes: volume, orientation, parts and their outward normals") {
  for (const Diagonal diagonal : {Diagonal::right, Diagonal::left, Diagonal::crisscross}) {
    check_box<2>({4, 3}, {1.5, 0.5}, diagonal);
    check_box<2>({1, 1}, {1, 1}, diagonal);
  }
  for (const Diagonal diagonal : {Diagonal::right, Diagonal::left}) check_box<3>({2, 3, 2}, {1, 2, 0.5}, diagonal);
  CHECK(box<2>({3, 2}, {1, 1}, Diagonal::right).cells.rows() == 12);
  CHECK(box<2>({3, 2}, {1, 1}, Diagonal::crisscross).cells.rows() == 24);
  CHECK(box<3>({2, 2, 2}, {1, 1, 1}, Diagonal::right).cells.rows() == 48);
  CHECK_THROWS_AS(box<2>({0, 1}, {1, 1}, Diagonal::right), std::invalid_argument);
  CHECK_THROWS_AS(box<2>({1, 1}, {1, -1}, Diagonal::right), std::invalid_argument);
  CHECK_THROWS_AS(box<3>({1, 1, 1}, {1, 1, 1}, Diagonal::crisscross), std::invalid_argument);
  CHECK_THROWS_WITH_AS(box<2>({1, 1}, {1, 1}, Diagonal::right).part("roof"),
                       "the mesh has no boundary part 'roof'; its parts are: bottom, left, right, top",
                       std::invalid_argument);
}

TEST_CASE("the right diagonal joins (0,0) and (1,1), the left one its mirror image") {
  const auto has_edge = [](const Mesh<2>& mesh, Index a, Index b) {
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
      if ((mesh.cells.row(c).array() == a).any() && (mesh.cells.row(c).array() == b).any()) return true;
    return false;
  };
  CHECK(has_edge(box<2>({1, 1}, {1, 1}, Diagonal::right), 0, 3));
  CHECK_FALSE(has_edge(box<2>({1, 1}, {1, 1}, Diagonal::right), 1, 2));
  CHECK(has_edge(box<2>({1, 1}, {1, 1}, Diagonal::left), 1, 2));
}

TEST_CASE("lists are refused by the first faulty entry") {
  CHECK(Lists().refusal() == "");
  Lists bad;
  SUBCASE("not finite") {
    bad.nodes(2, 1) = NAN;
    CHECK(bad.names("node 2"));
  }
  SUBCASE("infinite") {
    bad.nodes(3, 0) = INFINITY;
    CHECK(bad.names("node 3"));
  }
  SUBCASE("duplicate") {
    bad.nodes.row(3) = bad.nodes.row(1);
    CHECK(bad.names("nodes 1 and 3"));
  }
  SUBCASE("out of range") {
    bad.cells(1, 2) = 4;
    CHECK(bad.names("cell 1 names node 4"));
  }
  SUBCASE("negative") {
    bad.cells(0, 0) = -1;
    CHECK(bad.names("cell 0 names node -1"));
  }
  SUBCASE("inverted") {
    std::swap(bad.cells(1, 0), bad.cells(1, 1));
    CHECK(bad.names("cell 1 is inverted"));
  }
  SUBCASE("flat") {
    bad.nodes.row(2) << 0.5, 0.5;
    CHECK(bad.names("cell 1 is flat"));
  }
  SUBCASE("node used twice in a cell") {
    bad.cells(0, 1) = 0;
    CHECK(bad.names("cell 0 is flat"));
  }
  SUBCASE("orphan") {
    bad.nodes.conservativeResize(5, 2);
    bad.nodes.row(4) << 2, 2;
    CHECK(bad.names("node 4 belongs to no cell"));
  }
  SUBCASE("inner facet") {
    bad.parts["floor"] << 0, 3;
    CHECK(bad.names("facet 0 of part 'floor'"));
  }
  SUBCASE("facet out of range") {
    bad.parts["floor"] << 0, 9;
    CHECK(bad.names("facet 0 of part 'floor'"));
  }
  SUBCASE("empty part") {
    bad.parts["floor"].resize(0, 2);
    CHECK(bad.names("'floor' has no facets"));
  }
  SUBCASE("no cells") {
    bad.cells.resize(0, 3);
    CHECK(bad.names("no cells"));
  }
}

TEST_CASE("lists in space are refused alike") {
  const Mesh<3> brick = box<3>({1, 1, 1}, {1, 1, 1}, Diagonal::right);
  RealTable<3> nodes = brick.nodes;
  IndexTable<4> cells = brick.cells;
  std::map<std::string, IndexTable<3>> parts{{"floor", brick.part("bottom").nodes}};
  const auto names = [&](const std::string& words) {
    try {
      mesh_from_lists<3>(nodes, cells, parts);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what()).find(words) != std::string::npos;
    }
    return words.empty();
  };
  CHECK(names(""));
  SUBCASE("not finite") {
    nodes(2, 2) = NAN;
    CHECK(names("node 2"));
  }
  SUBCASE("duplicate") {
    nodes.row(7) = nodes.row(0);
    CHECK(names("nodes 0 and 7"));
  }
  SUBCASE("out of range") {
    cells(5, 3) = 8;
    CHECK(names("cell 5 names node 8"));
  }
  SUBCASE("inverted") {
    std::swap(cells(1, 0), cells(1, 1));
    CHECK(names("cell 1 is inverted"));
  }
  SUBCASE("flat") {
    cells(0, 1) = cells(0, 0);
    CHECK(names("cell 0 is flat"));
  }
  SUBCASE("orphan") {
    nodes.conservativeResize(9, 3);
    nodes.row(8) << 2, 2, 2;
    CHECK(names("node 8 belongs to no cell"));
  }
  SUBCASE("a cell twice") {
    cells.conservativeResize(8, 4);
    cells.row(6) = cells.row(0);
    cells.row(7) = cells.row(0);
    CHECK(names("more than two cells share a facet"));
  }
  SUBCASE("inner facet") {
    parts["floor"].row(0) << 0, 1, 7;
    CHECK(names("facet 0 of part 'floor'"));
  }
  SUBCASE("no part of that name") {
    CHECK_THROWS_WITH_AS(brick.part("roof"),
                         "the mesh has no boundary part 'roof'; its parts are: back, bottom, front, left, right, top",
                         std::invalid_argument);
  }
  SUBCASE("a box of nothing") {
    CHECK_THROWS_AS(box<3>({1, 0, 1}, {1, 1, 1}, Diagonal::right), std::invalid_argument);
    CHECK_THROWS_AS(box<3>({1, 1, 1}, {1, 1, 0}, Diagonal::right), std::invalid_argument);
  }
}

TEST_CASE("prolongation is exact between nested meshes and refuses others") {
  for (const Diagonal diagonal : {Diagonal::right, Diagonal::left}) {
    check_prolongation<2>(box<2>({3, 2}, {1, 2}, diagonal), box<2>({12, 8}, {1, 2}, diagonal));
    check_prolongation<3>(box<3>({2, 1, 2}, {1, 2, 1}, diagonal), box<3>({4, 2, 4}, {1, 2, 1}, diagonal));
  }
  check_prolongation<2>(box<2>({4, 4}, {1, 1}, Diagonal::crisscross), box<2>({8, 8}, {1, 1}, Diagonal::crisscross));
  const Mesh<2> coarse = box<2>({2, 2}, {1, 1}, Diagonal::right);
  const auto refuses = [&](const Mesh<2>& fine) {
    CHECK_THROWS_AS(prolongation<2>(coarse, fine), std::invalid_argument);
  };
  refuses(box<2>({3, 3}, {1, 1}, Diagonal::right));
  refuses(box<2>({4, 4}, {1, 1}, Diagonal::left));
  refuses(box<2>({4, 4}, {2, 1}, Diagonal::right));
  const Mesh<3> brick = box<3>({2, 2, 2}, {1, 1, 1}, Diagonal::right);
  CHECK_THROWS_AS(prolongation<3>(brick, box<3>({3, 2, 2}, {1, 1, 1}, Diagonal::right)), std::invalid_argument);
}
