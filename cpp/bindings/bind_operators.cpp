#include "bindings.hpp"
#include "warmslip/fem/contact_surface.hpp"
#include "warmslip/fem/operators.hpp"

namespace warmslip::bindings {
namespace {

template <int d>
void bind(py::module_& m) {
  using L = Layout<d>;
  py::class_<L, std::shared_ptr<L>>(m, name<d>("Layout").c_str(),
                                    "A mesh distributed over the ranks of a communicator.")
      .def(py::init([](const petsc4py::Comm& comm, std::shared_ptr<Mesh<d>> mesh) {
             return std::make_shared<L>(comm, std::move(mesh));
           }),
           py::arg("comm"), py::arg("mesh"))
      .def_property_readonly("owned_nodes", &L::owned, "Nodes this rank owns.")
      .def_property_readonly("local_cells", &L::cells, "Cells of this rank.")
      .def_property_readonly("mesh_nodes", &L::mesh_nodes, "Mesh number of every local node, owned first.")
      .def(
          "vector", [](const L& l, int block) { return release(l.vector(block)); }, py::arg("block"),
          "A zero vector, `block` unknowns a node.")
      .def("gather", &L::gather, py::arg("vec"), "The whole vector in mesh numbering, on every rank (collective).")
      .def("distribute", &L::distribute, py::arg("values"), py::arg("vec"),
           "Sets `vec` from values in mesh numbering, (nodes * block).");
  using N = Norms<d>;
  py::class_<N, std::shared_ptr<N>>(m, name<d>("Norms").c_str(), "Exact norms of P1 functions.")
      .def(py::init<const L&>(), py::arg("layout"), py::keep_alive<1, 2>())
      .def("l2", &N::l2, py::arg("vec"), "|v|_L2 of a scalar or a vector field (collective).")
      .def("v", &N::v, py::arg("vec"), "|v|_V = |eps(v)|_L2 of a displacement (collective).");

  using O = Operators<d>;
  auto operators = py::class_<O, std::shared_ptr<O>>(
                       m, name<d>("Operators").c_str(),
                       "The constant matrices as petsc4py objects, without boundary conditions; None is absent.")
                       .def(py::init<const L&, const Problem<d>&>(), py::arg("layout"), py::arg("problem"))
                       .def_readonly("prescribed_displacement", &O::prescribed_displacement,
                                     "Global scalar indices with u = 0 owned by this rank.")
                       .def_readonly("prescribed_temperature", &O::prescribed_temperature,
                                     "Global nodes with theta = 0 owned by this rank.");
  const auto matrix = [&](const char* attribute, MatHandle O::*member, const char* doc) {
    operators.def_property_readonly(
        attribute, [member](const O& o) { return share(o.*member); }, doc);
  };
  matrix("mass", &O::mass, "(theta, eta), times the capacity");
  matrix("inertia", &O::inertia, "rho (w, v), of PETSc's type MAIJ; convert('aij') has its entries");
  matrix("elasticity", &O::elasticity, "a(u, v)");
  matrix("viscosity", &O::viscosity, "b(w, v)");
  matrix("conductivity", &O::conductivity, "d(theta, eta)");
  matrix("expansion", &O::expansion, "m(theta, v)");
  matrix("heating", &O::heating, "e(w, eta)");
  matrix("exchange", &O::exchange, "int k_c theta eta over Gamma_C");
  operators.def_property_readonly(
      "reference", [](const O& o) { return o.common_reference == 0 ? share(o.reference) : nullptr; },
      "m(reference temperature, v), a vector that is a load; None where that is 0 or the same in all regions, and the "
      "stepper knows it");
  m.def(
      "momentum_matrix",
      [](const L& l, const Problem<d>& p, const O& o, double k) { return release(momentum_matrix<d>(l, p, o, k)); },
      py::arg("layout"), py::arg("problem"), py::arg("operators"), py::arg("k"),
      "rho M / k + B + k A with prescribed displacements eliminated.");
  m.def(
      "heat_matrix", [](const O& o, double k) { return release(heat_matrix<d>(o, k)); }, py::arg("operators"),
      py::arg("k"), "M / k + D + J with prescribed temperatures eliminated.");

  using S = ContactSurface<d>;
  py::class_<S, std::shared_ptr<S>>(m, name<d>("ContactSurface").c_str(),
                                    "Contact points, weights and normals, the same on every rank.")
      .def(py::init<const L&, const Problem<d>&>(), py::arg("layout"), py::arg("problem"), py::keep_alive<1, 2>())
      .def_property_readonly(
          "positions", [](const S& s) { return s.positions(); }, "(points, d)")
      .def_property_readonly(
          "normals", [](const S& s) { return s.normals(); }, "(points, d), outward unit normals")
      .def_property_readonly(
          "weights", [](const S& s) { return s.weights(); }, "(points), area")
      .def_property_readonly(
          "contacts",
          [](const S& s) {
            std::vector<std::size_t> parts;
            for (Eigen::Index i = 0; i < s.points(); ++i) parts.push_back(s.contact(i));
            return parts;
          },
          "(points), which of the problem's contact parts a point lies on")
      .def_property_readonly("nodes", &S::nodes, "Number of contact nodes.")
      .def("unknowns", &S::unknowns, py::arg("block"), "Global scalar indices of the contact unknowns, (d nodes).");

  using Q = LoadQuadrature<d>;
  py::class_<Q, std::shared_ptr<Q>>(m, name<d>("LoadQuadrature").c_str(),
                                    "Quadrature over the rank's cells, or the facets of a part.")
      .def(py::init<const L&, const std::optional<std::string>&, int>(), py::arg("layout"), py::arg("part"),
           py::arg("points"), py::keep_alive<1, 2>())
      .def_property_readonly("positions", &Q::positions, "(points, d), this rank's.")
      .def(
          "load", [](const Q& q, const RealTable<Eigen::Dynamic>& values) { return release(q.load(values)); },
          py::arg("values"), "int f . v with values (points, components) (collective).")
      .def("squared_distance", &Q::squared_distance, py::arg("field"), py::arg("values"),
           "|field - values|_L2 squared (collective).")
      .def("squared_strain_distance", &Q::squared_strain_distance, py::arg("field"), py::arg("gradients"),
           "|eps(field) - sym gradients|_L2 squared; gradients (points, d*d) (collective).");
}

}  // namespace

void bind_operators(py::module_& m) {
  bind<2>(m);
  bind<3>(m);
}

}  // namespace warmslip::bindings
