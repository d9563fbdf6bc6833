// The C++ tests' own main: doctest between PetscInitialize and PetscFinalize. On several processes every rank runs
// every test, since most of them are collective, and the exit status is non-zero when any rank fails.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <petscsys.h>

int main(int argc, char** argv) {
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  doctest::Context context(argc, argv);
  int failed = context.run();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscFinalize());
  return failed;
}
