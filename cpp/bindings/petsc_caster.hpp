// pybind11 casters between petsc4py's objects and PETSc's handles. The functions come from the capsules petsc4py
// publishes (petsc4py.PETSc.__pyx_capi__), looked up at run time: no petsc4py header is needed to build, and the
// petsc4py that is imported is by construction the one that is used.
#pragma once

#include <petscksp.h>
#include <pybind11/pybind11.h>

#include <string>

namespace petsc4py {

// The C function `name` that petsc4py publishes. Raises KeyError if there is none.
template <class Function>
Function* capi(const char* name) {
  const pybind11::dict table = pybind11::module_::import("petsc4py.PETSc").attr("__pyx_capi__");
  const pybind11::object capsule = table[name];
  void* function = PyCapsule_GetPointer(capsule.ptr(), PyCapsule_GetName(capsule.ptr()));
  if (!function) throw pybind11::error_already_set();
  return reinterpret_cast<Function*>(function);
}

// A communicator argument: an mpi4py.MPI.Comm, a petsc4py.PETSc.Comm or None (PETSC_COMM_WORLD). Borrowed, not
// duplicated.
struct Comm {
  MPI_Comm value = MPI_COMM_NULL;
  operator MPI_Comm() const { return value; }
};

}  // namespace petsc4py

namespace pybind11::detail {

// An argument is borrowed: it lives as long as the Python object. A returned handle is given away: Python takes over
// the caller's reference. A null handle becomes None.
template <class Handle, class Traits>
struct petsc_caster {
  bool load(handle source, bool /*convert*/) {
    if (!isinstance(source, module_::import("petsc4py.PETSc").attr(Traits::type))) return false;
    static auto* const get = petsc4py::capi<Handle(PyObject*)>(Traits::getter);
    value = get(source.ptr());
    if (!value) {  // an object without a handle, e.g. PETSc.Mat()
      PyErr_Clear();
      throw value_error(std::string("this PETSc.") + Traits::type + " holds no object (create it first)");
    }
    return true;
  }

  static handle cast(Handle source, return_value_policy /*policy*/, handle /*parent*/) {
    if (!source) return none().release();
    static auto* const make = petsc4py::capi<PyObject*(Handle)>(Traits::maker);
    PyObject* object = make(source);  // holds a reference of its own
    if (object) PetscObjectDereference(reinterpret_cast<PetscObject>(source));
    return object;
  }

  operator Handle() const { return value; }
  template <class>
  using cast_op_type = Handle;

  Handle value = nullptr;
};

// Vec is a pointer to _p_Vec, and pybind11 looks casters up by the type pointed to.
#define WARMSLIP_PETSC_CASTER(T)                                   \
  struct T##_traits {                                              \
    static constexpr const char* type = #T;                        \
    static constexpr const char* getter = "PyPetsc" #T "_Get";     \
    static constexpr const char* maker = "PyPetsc" #T "_New";      \
  };                                                               \
  template <>                                                      \
  struct type_caster<::_p_##T> : petsc_caster<::T, T##_traits> {   \
    static constexpr auto name = const_name("petsc4py.PETSc." #T); \
  };
WARMSLIP_PETSC_CASTER(Vec)
WARMSLIP_PETSC_CASTER(Mat)
WARMSLIP_PETSC_CASTER(KSP)
WARMSLIP_PETSC_CASTER(DM)
#undef WARMSLIP_PETSC_CASTER

template <>
struct type_caster<petsc4py::Comm> {
  PYBIND11_TYPE_CASTER(petsc4py::Comm, const_name("mpi4py.MPI.Comm | petsc4py.PETSc.Comm | None"));

  bool load(handle source, bool /*convert*/) {
    static auto* const get = petsc4py::capi<MPI_Comm(PyObject*, MPI_Comm)>("GetComm");
    value.value = get(source.ptr(), PETSC_COMM_WORLD);
    if (PyErr_Occurred()) {
      PyErr_Clear();
      return false;
    }
    return value.value != MPI_COMM_NULL;
  }
};

}  // namespace pybind11::detail
