#include <csignal>

#include "bindings.hpp"

using namespace warmslip::bindings;

namespace {

// Initialises PETSc and MPI. A reader of the output that has seen enough raises Python's own error afterwards, and not
// PETSc's banner.
void start_petsc() {
  struct sigaction before {};
  sigaction(SIGPIPE, nullptr, &before);
  py::module_::import("petsc4py.PETSc");
  sigaction(SIGPIPE, &before, nullptr);
}

// Two PETSc libraries in one process end in a crash far from its cause: say so at import.
void check_petsc() {
  PetscInt major, minor, patch, release;
  PetscGetVersionNumber(&major, &minor, &patch, &release);
  const py::tuple theirs = py::module_::import("petsc4py.PETSc").attr("Sys").attr("getVersion")();
  const bool same = major == PETSC_VERSION_MAJOR && minor == PETSC_VERSION_MINOR && theirs[0].cast<int>() == major &&
                    theirs[1].cast<int>() == minor;
  if (!same)
    throw py::import_error("warmslip was built with PETSc " + std::to_string(PETSC_VERSION_MAJOR) + "." +
                           std::to_string(PETSC_VERSION_MINOR) + ", but PETSc " + std::to_string(major) + "." +
                           std::to_string(minor) + " is loaded and petsc4py was built with " +
                           py::str(theirs).cast<std::string>() + "; run `make setup`");
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.doc() =
      "The compiled core of warmslip: meshes, operators on PETSc, the contact solver and the time stepper, for d = 2 "
      "and 3.";
  start_petsc();
  check_petsc();
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const warmslip::PetscFailure& e) {
      const py::object error = py::module_::import("petsc4py.PETSc").attr("Error");
      PyErr_SetObject(error.ptr(), error(e.code).ptr());
    }
  });
  m.attr("petsc_version") = std::to_string(PETSC_VERSION_MAJOR) + "." + std::to_string(PETSC_VERSION_MINOR) + "." +
                            std::to_string(PETSC_VERSION_SUBMINOR);
  m.attr("compiler") = "g++ " __VERSION__;
  bind_mesh(m);
  bind_problem(m);
  bind_operators(m);
  bind_factor(m);
  bind_stepper(m);
}
