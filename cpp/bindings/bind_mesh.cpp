#include "bindings.hpp"
#include "warmslip/mesh/box.hpp"
#include "warmslip/mesh/prolongation.hpp"
#include "warmslip/mesh/quadrature.hpp"

namespace warmslip::bindings {
namespace {

template <int d>
void bind(py::module_& m) {
  py::class_<Mesh<d>, std::shared_ptr<Mesh<d>>>(m, name<d>("Mesh").c_str(),
                                                "Simplicial mesh with named boundary parts.")
      .def_static(
          "box",
          [](const std::array<int, d>& counts, const std::array<double, d>& lengths, Diagonal diagonal) {
            return std::make_shared<Mesh<d>>(box<d>(counts, lengths, diagonal));
          },
          py::arg("counts"), py::arg("lengths"), py::arg("diagonal"),
          "Box of counts[a] cells along axis a, each cut along `diagonal`; parts left, right, bottom, top (front, "
          "back).")
      .def_static(
          "from_lists",
          [](const RealTable<d>& nodes, const IndexTable<d + 1>& cells,
             const std::map<std::string, IndexTable<d>>& parts) {
            return std::make_shared<Mesh<d>>(mesh_from_lists<d>(nodes, cells, parts));
          },
          py::arg("nodes"), py::arg("cells"), py::arg("parts"),
          "Mesh from nodes (n, d), cells (c, d+1) and facets (f, d) by part; ValueError names the first faulty entry.")
      .def_property_readonly(
          "nodes", [](const Mesh<d>& mesh) { return mesh.nodes; }, "(nodes, d) coordinates, length.")
      .def_property_readonly(
          "cells", [](const Mesh<d>& mesh) { return mesh.cells; }, "(cells, d+1) node numbers.")
      .def_property_readonly(
          "parts",
          [](const Mesh<d>& mesh) {
            std::map<std::string, IndexTable<d>> parts;
            for (const auto& [part, facets] : mesh.parts) parts[part] = facets.nodes;
            return parts;
          },
          "Facets (f, d) of every named boundary part.")
      .def(
          "area_normals",
          [](const Mesh<d>& mesh, const std::string& part) {
            const Facets<d>& facets = mesh.part(part);
            RealTable<d> out(facets.nodes.rows(), d);
            for (Eigen::Index f = 0; f < out.rows(); ++f) out.row(f) = area_normal(mesh, facets, f).transpose();
            return out;
          },
          py::arg("part"), "Outward normals of the facets of a part, (f, d); their lengths are the areas.")
      .def_property_readonly("dim", [](const Mesh<d>&) { return d; });
  m.def(
      "prolongation", [](const Mesh<d>& coarse, const Mesh<d>& fine) { return prolongation<d>(coarse, fine); },
      py::arg("coarse"), py::arg("fine"),
      "Exact interpolation of P1 functions between nested meshes, a SciPy CSR matrix (fine nodes, coarse nodes); "
      "ValueError if they are not nested.");
}

}  // namespace

void bind_mesh(py::module_& m) {
  py::enum_<Diagonal>(m, "Diagonal")
      .value("right", Diagonal::right)
      .value("left", Diagonal::left)
      .value("crisscross", Diagonal::crisscross);
  m.def(
      "simplex_rule",
      [](int dim, int points) {
        const Rule rule = simplex_rule(dim, points);
        return std::pair(rule.barycentric, rule.weights);
      },
      py::arg("dim"), py::arg("points"),
      "Barycentric points (q, dim+1) and weights (q), exact to degree 2 points - 1.");
  bind<2>(m);
  bind<3>(m);
}

}  // namespace warmslip::bindings
