#include "bindings.hpp"
#include "warmslip/problem.hpp"

namespace warmslip::bindings {
namespace {

template <int d>
void bind(py::module_& m) {
  py::class_<Material<d>>(m, name<d>("Material").c_str(),
                          "Density and the constant tensors of (2.1)-(2.4); fourth-order ones in Mandel form.")
      .def(py::init<double, Tensor4<d>, Tensor4<d>, Tensor2<d>, Tensor2<d>, Tensor2<d>>(), py::kw_only(),
           py::arg("density"), py::arg("elasticity"), py::arg("viscosity"), py::arg("conductivity"),
           py::arg("expansion"), py::arg("heating"))
      .def_readonly("density", &Material<d>::density)
      .def_readonly("elasticity", &Material<d>::elasticity)
      .def_readonly("viscosity", &Material<d>::viscosity)
      .def_readonly("conductivity", &Material<d>::conductivity)
      .def_readonly("expansion", &Material<d>::expansion)
      .def_readonly("heating", &Material<d>::heating);
  py::class_<Problem<d>, std::shared_ptr<Problem<d>>>(m, name<d>("Problem").c_str(),
                                                      "A mesh with material, supports and contact part.")
      .def(py::init([](std::shared_ptr<Mesh<d>> mesh, const Material<d>& material, std::vector<std::string> clamped,
                       std::vector<std::string> cooled, std::string contact_part, double stiffness, double friction,
                       int quadrature, double conductance) {
             return std::make_shared<Problem<d>>(Problem<d>{std::move(mesh),
                                                            material,
                                                            std::move(clamped),
                                                            std::move(cooled),
                                                            std::move(contact_part),
                                                            {{stiffness}, {friction}},
                                                            {quadrature},
                                                            conductance});
           }),
           py::kw_only(), py::arg("mesh"), py::arg("material"), py::arg("clamped"), py::arg("cooled"),
           py::arg("contact_part"), py::arg("stiffness"), py::arg("friction"), py::arg("quadrature"),
           py::arg("conductance"),
           "`clamped` and `cooled` are part names with u = 0 and theta = 0; quadrature 0 is nodal, n Gauss's with n "
           "points.")
      .def_property_readonly("mesh", [](const Problem<d>& p) { return std::const_pointer_cast<Mesh<d>>(p.mesh); })
      .def_readonly("material", &Problem<d>::material);
  m.def("stress", &stress<d>, py::arg("mesh"), py::arg("material"), py::arg("u"), py::arg("w"), py::arg("theta"),
        "Cauchy stress (2.1) at the cells' centroids, (cells, d*d), from nodal u, w (nodes, d) and theta (nodes).");
}

}  // namespace

void bind_problem(py::module_& m) {
  bind<2>(m);
  bind<3>(m);
}

}  // namespace warmslip::bindings
