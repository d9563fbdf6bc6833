# Finds a real PETSc through its pkg-config file and defines PETSc::PETSc. PETSC_DIR and PETSC_ARCH (variables or
# environment) name an installation; without them the default one is taken.
include(FindPackageHandleStandardArgs)
find_package(PkgConfig REQUIRED)

foreach(v PETSC_DIR PETSC_ARCH)
  if(NOT DEFINED ${v} AND DEFINED ENV{${v}})
    set(${v} "$ENV{${v}}")
  endif()
endforeach()

set(_saved "$ENV{PKG_CONFIG_PATH}")
if(PETSC_DIR)
  set(ENV{PKG_CONFIG_PATH} "${PETSC_DIR}/${PETSC_ARCH}/lib/pkgconfig:${PETSC_DIR}/lib/pkgconfig:${_saved}")
endif()
pkg_search_module(PETSC QUIET IMPORTED_TARGET GLOBAL PETSc petsc)
set(ENV{PKG_CONFIG_PATH} "${_saved}")

set(_why "no PETSc.pc: install libpetsc-real-dev or set PETSC_DIR and PETSC_ARCH")
if(PETSC_FOUND)
  find_file(_petscconf petscconf.h HINTS ${PETSC_INCLUDE_DIRS} ${PETSC_INCLUDEDIR} NO_DEFAULT_PATH)
  if(_petscconf)
    file(STRINGS "${_petscconf}" _complex REGEX "define PETSC_USE_COMPLEX 1")
    if(_complex)
      set(PETSC_FOUND FALSE)
      set(_why "this PETSc was built with complex scalars; a real one is needed")
    endif()
  endif()
  unset(_petscconf CACHE)
endif()

find_package_handle_standard_args(PETSc REQUIRED_VARS PETSC_LINK_LIBRARIES PETSC_FOUND
                                  VERSION_VAR PETSC_VERSION REASON_FAILURE_MESSAGE "${_why}")
if(PETSc_FOUND AND NOT TARGET PETSc::PETSc)
  add_library(PETSc::PETSc ALIAS PkgConfig::PETSC)
endif()
