// The two ways to factor; see factor.hpp for what they have in common.
#pragma once
#include "warmslip/la/factor.hpp"

namespace warmslip {

/// CHOLMOD, one rank; nullptr when this build has no CHOLMOD or the factorization breaks down or is inaccurate.
std::unique_ptr<Factor> factor_with_cholmod(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, int block);

/// PETSc's KSP under `prefix`, any number of ranks: two solves a step, and one for each column of C.
std::unique_ptr<Factor> factor_with_petsc(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry,
                                          const std::string& prefix);

}  // namespace warmslip
