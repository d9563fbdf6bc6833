#include "bindings.hpp"
#include "warmslip/la/factor.hpp"

namespace warmslip::bindings {

void bind_factor(py::module_& m) {
  py::enum_<Backend>(m, "Backend")
      .value("automatic", Backend::automatic)
      .value("cholmod", Backend::cholmod)
      .value("petsc", Backend::petsc);
  py::enum_<Symmetry>(m, "Symmetry")
      .value("positive_definite", Symmetry::positive_definite)
      .value("definite_or_refused", Symmetry::definite_or_refused)
      .value("symmetric", Symmetry::symmetric)
      .value("general", Symmetry::general);
  py::class_<Factor>(m, "Factor", "A factored operator with some unknowns held apart (collective).")
      .def(py::init([](Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, int block,
                       const std::string& prefix,
                       Backend backend) { return factor(k, trailing, symmetry, block, prefix, backend); }),
           py::arg("matrix"), py::arg("trailing"), py::arg("symmetry"), py::arg("block"), py::arg("prefix"),
           py::arg("backend"))
      .def("reduce", &Factor::reduce, py::arg("right"), "E^T K^-1 r: the first half of a solve.")
      .def("expand", &Factor::expand, py::arg("load"), py::arg("out"), "K^-1 (r - E load): the second half.")
      .def("solve", &Factor::solve, py::arg("right"), py::arg("out"), "K^-1 r.")
      .def(
          "compliance", [](Factor& f) { return f.compliance(); }, "E^T K^-1 E.")
      .def_property_readonly("substitutions", &Factor::substitutions)
      .def_property_readonly("bytes", &Factor::bytes)
      .def_property_readonly("description", &Factor::description);
}

}  // namespace warmslip::bindings
