// What the binding files share: declarations and the hand-over of PETSc handles. No logic, no defaults.
#pragma once
#include "petsc_caster.hpp"
// after the casters
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <string>

#include "warmslip/la/petsc.hpp"

namespace warmslip::bindings {

namespace py = pybind11;

void bind_mesh(py::module_& m);
void bind_problem(py::module_& m);
void bind_operators(py::module_& m);
void bind_factor(py::module_& m);
void bind_stepper(py::module_& m);

/// "Mesh" and d = 2 give "Mesh2".
template <int d>
std::string name(const char* base) {
  return base + std::to_string(d);
}

/// A second owner of a handle that stays ours: the caster gives the reference away.
template <class T, auto destroy>
T share(const Handle<T, destroy>& handle) {
  if (handle) WARMSLIP_PETSC(PetscObjectReference(reinterpret_cast<PetscObject>(static_cast<T>(handle))));
  return handle;
}

/// Gives a handle away for good.
template <class T, auto destroy>
T release(Handle<T, destroy>&& handle) {
  T object = handle;
  *handle.out() = nullptr;
  return object;
}

}  // namespace warmslip::bindings
