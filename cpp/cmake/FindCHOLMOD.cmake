# Finds SuiteSparse's CHOLMOD and defines CHOLMOD::CHOLMOD. Looks beside PETSc first ($PETSC_DIR/$PETSC_ARCH, where
# PETSc's own --download-suitesparse puts it), then in the system. FindPETSc has set PETSC_DIR and PETSC_ARCH.
include(FindPackageHandleStandardArgs)

set(_hints)
if(PETSC_DIR)
  set(_hints "${PETSC_DIR}/${PETSC_ARCH}" "${PETSC_DIR}")
endif()
find_path(CHOLMOD_INCLUDE_DIR cholmod.h HINTS ${_hints} PATH_SUFFIXES include/suitesparse include suitesparse)
find_library(CHOLMOD_LIBRARY cholmod HINTS ${_hints} PATH_SUFFIXES lib)
mark_as_advanced(CHOLMOD_INCLUDE_DIR CHOLMOD_LIBRARY)

find_package_handle_standard_args(CHOLMOD REQUIRED_VARS CHOLMOD_LIBRARY CHOLMOD_INCLUDE_DIR)
if(CHOLMOD_FOUND AND NOT TARGET CHOLMOD::CHOLMOD)
  add_library(CHOLMOD::CHOLMOD UNKNOWN IMPORTED)
  set_target_properties(CHOLMOD::CHOLMOD PROPERTIES
    IMPORTED_LOCATION "${CHOLMOD_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${CHOLMOD_INCLUDE_DIR}")
endif()
