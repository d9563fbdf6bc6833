#include "warmslip/la/petsc.hpp"

#include <petsc/private/garbagecollector.h>

namespace warmslip {

PetscFailure::PetscFailure(int petsc_code, const std::string& where)
    : std::runtime_error("PETSc error " + std::to_string(petsc_code) + " in " + where), code(petsc_code) {}

void check(PetscErrorCode error, const char* where) {
  if (error) throw PetscFailure(static_cast<int>(error), where);
}

PetscErrorCode destroy_together(KSP* ksp) {
  int size;
  MPI_Comm_size(PetscObjectComm(reinterpret_cast<PetscObject>(*ksp)), &size);
  return size == 1 ? KSPDestroy(ksp) : PetscObjectDelayedDestroy(reinterpret_cast<PetscObject*>(ksp));
}

void free_what_all_ranks_dropped(MPI_Comm comm) { WARMSLIP_PETSC(PetscGarbageCleanup(comm)); }

VecHandle duplicate(Vec like) {
  VecHandle v;
  WARMSLIP_PETSC(VecDuplicate(like, v.out()));
  WARMSLIP_PETSC(VecSet(v, 0));
  return v;
}

Eigen::Index block_size(Vec v) {
  PetscInt block;
  WARMSLIP_PETSC(VecGetBlockSize(v, &block));
  return block;
}

void multiply(Mat a, Vec x, Vec y) {
  if (a) WARMSLIP_PETSC(MatMult(a, x, y));
}

Values::Values(Vec vec) : vec_(vec) {
  if (!vec) return;
  WARMSLIP_PETSC(VecGetLocalSize(vec, &size_));
  WARMSLIP_PETSC(VecGetArray(vec, &data_));
}

Values::~Values() {
  if (vec_) VecRestoreArray(vec_, &data_);
}

}  // namespace warmslip
