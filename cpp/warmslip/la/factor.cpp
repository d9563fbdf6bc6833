#include "warmslip/la/factor.hpp"

#include "warmslip/la/factor_backends.hpp"

namespace warmslip {

void Factor::solve(Vec r, Vec x) { expand(Eigen::VectorXd::Zero(reduce(r).size()), x); }

std::unique_ptr<Factor> factor(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, int block,
                               const std::string& prefix, Backend backend) {
  int size;
  MPI_Comm_size(PetscObjectComm(reinterpret_cast<PetscObject>(k)), &size);
  const bool possible = size == 1 && symmetry != Symmetry::general;
  if (backend == Backend::cholmod && !possible)
    throw std::invalid_argument(
        "the CHOLMOD backend needs one rank and a symmetric operator; use backend 'petsc' or 'automatic'");
  if (possible && backend != Backend::petsc) {
    if (auto sequential = factor_with_cholmod(k, trailing, symmetry, block)) return sequential;
    // perhaps not definite after all; MUMPS counts its negative pivots
    if (symmetry == Symmetry::positive_definite) symmetry = Symmetry::symmetric;
    if (backend == Backend::cholmod)
      throw std::runtime_error("CHOLMOD is not in this build or could not factor the " + prefix + " operator");
  }
  return factor_with_petsc(k, trailing, symmetry, prefix);
}

}  // namespace warmslip
