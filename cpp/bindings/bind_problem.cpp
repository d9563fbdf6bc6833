#include "bindings.hpp"
#include "warmslip/physics/problem.hpp"

namespace warmslip::bindings {
namespace {

template <int d>
void bind(py::module_& m) {
  using M = Material<d>;
  using Four = std::optional<Tensor4<d>>;
  using Two = std::optional<Tensor2<d>>;
  py::class_<M>(m, name<d>("Material").c_str(),
                "Density and the constant tensors of (2.1)-(2.4), fourth-order ones in Mandel form; None is absent.")
      .def(py::init([](double density, Four elasticity, Four viscosity, Two conductivity, Two expansion, Two heating,
                       double capacity, double reference, std::array<double, 3> out_of_plane) {
             const auto [elastic, viscous, expanding] = out_of_plane;
             return M{density,      elasticity, viscosity,
                      conductivity, expansion,  heating,
                      capacity,     reference,  {elastic, viscous, expanding}};
           }),
           py::kw_only(), py::arg("density"), py::arg("elasticity"), py::arg("viscosity"), py::arg("conductivity"),
           py::arg("expansion"), py::arg("heating"), py::arg("capacity"), py::arg("reference"), py::arg("out_of_plane"),
           "`reference` is the temperature without thermal stress; `out_of_plane` what tr eps(u), tr eps(w) and "
           "-(theta - "
           "reference) are multiplied by in sigma_zz of a plane.")
      .def_readonly("density", &M::density)
      .def_readonly("elasticity", &M::elasticity)
      .def_readonly("viscosity", &M::viscosity)
      .def_readonly("conductivity", &M::conductivity)
      .def_readonly("expansion", &M::expansion)
      .def_readonly("heating", &M::heating)
      .def_readonly("capacity", &M::capacity)
      .def_readonly("reference", &M::reference)
      .def_property_readonly(
          "out_of_plane",
          [](const M& m) {
            return std::array{m.out_of_plane.elastic, m.out_of_plane.viscous, m.out_of_plane.expansion};
          },
          "what tr eps(u), tr eps(w) and -(theta - reference) are multiplied by in sigma_zz");
  using S = PartSprings<d>;
  py::class_<S>(m, name<d>("PartSprings").c_str(), "Springs and dashpots on a part.")
      .def(py::init([](std::string part, Point<d> stiffness, double normal_stiffness, Point<d> damping,
                       double normal_damping) {
             return S{std::move(part), {stiffness, normal_stiffness}, {damping, normal_damping}};
           }),
           py::kw_only(), py::arg("part"), py::arg("stiffness"), py::arg("normal_stiffness"), py::arg("damping"),
           py::arg("normal_damping"), "Traction -(stiffness u + damping w), along the axes and along the normal.");
  using P = Problem<d>;
  py::class_<P, std::shared_ptr<P>>(m, name<d>("Problem").c_str(), "A mesh with materials, supports and contact parts.")
      .def(py::init([](std::shared_ptr<Mesh<d>> mesh, std::vector<M> materials, std::vector<int> regions,
                       std::vector<std::string> prescribed_displacement,
                       std::vector<std::string> prescribed_temperature, std::vector<ContactPart> contacts, bool lumped,
                       std::vector<std::pair<Index, Tensor2<d>>> held_nodes, std::vector<PartSprings<d>> springs) {
             std::vector<HeldNode<d>> held;
             for (const auto& [node, directions] : held_nodes) held.push_back({node, directions});
             return std::make_shared<P>(P{std::move(mesh), std::move(materials), std::move(regions),
                                          std::move(prescribed_displacement), std::move(prescribed_temperature),
                                          std::move(contacts), std::move(held), std::move(springs), lumped});
           }),
           py::kw_only(), py::arg("mesh"), py::arg("materials"), py::arg("regions"), py::arg("prescribed_displacement"),
           py::arg("prescribed_temperature"), py::arg("contacts"), py::arg("lumped"),
           py::arg("held_nodes") = std::vector<std::pair<Index, Tensor2<d>>>{},
           py::arg("springs") = std::vector<PartSprings<d>>{},
           "`regions` is the material of every cell, or empty; `prescribed_displacement` and `prescribed_temperature` "
           "are parts with given u and theta; "
           "`lumped` makes capacity and exchange diagonal; `held_nodes` are pairs of a node and the projector onto the "
           "directions in which its displacement is given.")
      .def_property_readonly("mesh", [](const P& p) { return std::const_pointer_cast<Mesh<d>>(p.mesh); })
      .def_readonly("materials", &P::materials)
      .def_property_readonly(
          "material", [](const P& p) { return p.materials.front(); }, "the first one")
      .def_readonly("lumped", &P::lumped)
      .def_property_readonly("moves", &P::moves, "Whether there is a velocity to solve for.")
      .def_property_readonly("conducts", &P::conducts, "Whether there is a temperature to solve for.");
  m.def("stress", &stress<d>, py::arg("problem"), py::arg("u"), py::arg("w"), py::arg("theta"),
        "Cauchy stress (2.1) at the cells' centroids, (cells, d*d), from nodal u, w (nodes, d) and theta (nodes); a "
        "field the problem does not have may be empty.");
  m.def("largest_strain", &largest_strain<d>, py::arg("mesh"), py::arg("u"),
        "Largest principal strain, in size, of all cells for nodal u (nodes, d); dimensionless.");
  m.def("stress_out_of_plane", &stress_out_of_plane<d>, py::arg("problem"), py::arg("u"), py::arg("w"),
        py::arg("theta"),
        "sigma_zz at the cells' centroids, (cells,), of a plane; zero in space. Arrays as for stress.");
}

}  // namespace

void bind_problem(py::module_& m) {
  using Pressure = std::function<std::array<double, 3>(double)>;
  using Bound = std::function<std::array<double, 3>(double, double)>;
  py::class_<NormalCompliance>(m, "NormalCompliance",
                               "p_nu(r) = min(stiffness max(r, 0)^exponent, pressure_limit) (2.8).")
      .def(py::init<double, double, double, Pressure>(), py::kw_only(), py::arg("stiffness"), py::arg("exponent"),
           py::arg("pressure_limit"), py::arg("custom"),
           "`custom`, when not None, takes its place: r > 0 to (pressure, derivative, energy).")
      .def("pressure", &NormalCompliance::pressure, py::arg("penetration"))
      .def("energy", &NormalCompliance::energy, py::arg("penetration"))
      .def_readonly("stiffness", &NormalCompliance::stiffness);
  py::class_<Friction>(m, "Friction", "|sigma_tau| <= min(cohesion + mu(|w_tau|) p_nu, limit) (2.9).")
      .def(py::init<double, double, double, double, double, double, Bound>(), py::kw_only(), py::arg("coefficient"),
           py::arg("cohesion"), py::arg("limit"), py::arg("kinetic"), py::arg("speed"), py::arg("regularisation"),
           py::arg("custom"),
           "`custom`, when not None, takes its place: (pressure, speed) to (bound, derivative by pressure, by speed).")
      .def(
          "bound", [](const Friction& f, double pressure, double speed) { return f.bound(pressure, speed).value; },
          py::arg("pressure"), py::arg("speed"));
  py::class_<ContactLaw>(m, "ContactLaw")
      .def(py::init<NormalCompliance, Friction>(), py::kw_only(), py::arg("compliance"), py::arg("friction"))
      .def_readonly("compliance", &ContactLaw::compliance)
      .def_readonly("friction", &ContactLaw::friction);
  py::class_<ContactPart>(m, "ContactPart", "One part of Gamma_C; without a law it only exchanges heat.")
      .def(py::init([](std::string part, std::optional<ContactLaw> law, int quadrature, double conductance,
                       double per_pressure, double share) {
             return ContactPart{std::move(part), std::move(law), {quadrature}, conductance, {per_pressure, share}};
           }),
           py::kw_only(), py::arg("part"), py::arg("law"), py::arg("quadrature"), py::arg("conductance"),
           py::arg("per_pressure"), py::arg("share"),
           "quadrature 0 is nodal, n Gauss's with n points; q . nu = (conductance + per_pressure p_nu) (theta - "
           "theta_F) "
           "- share |sigma_tau . w_tau|.")
      .def_readonly("part", &ContactPart::part)
      .def_readonly("law", &ContactPart::law);
  bind<2>(m);
  bind<3>(m);
}

}  // namespace warmslip::bindings
