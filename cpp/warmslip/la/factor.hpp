// A factored operator with some unknowns held apart: what the contact solver needs of a body, in two half solves.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "warmslip/la/petsc.hpp"

namespace warmslip {

enum class Backend { automatic, cholmod, petsc };
/// `definite_or_refused`: positive definite unless the data make it indefinite, which is refused with
/// `indefinite_coupling`.
enum class Symmetry { positive_definite, definite_or_refused, symmetric, general };

constexpr const char* indefinite_coupling =
    "time.coupling: the coupled operator is indefinite: a coupling R = +M of this size feeds in more energy than a "
    "step "
    "of inertia, viscosity and elasticity holds; give heat.heating the sign of -M, a smaller tensor, viscosity, or "
    "coupling = \"staggered\"";

/// K with the unknowns `trailing` (E selects them): x = K^-1 (r - E load) in two halves around the contact problem.
class Factor {
 public:
  virtual ~Factor() = default;

  /// First half: remembers r and returns E^T K^-1 r, on every rank.
  virtual Eigen::VectorXd reduce(Vec r) = 0;
  /// Second half: x = K^-1 (r - E load) for the r of the last `reduce`.
  virtual void expand(const Eigen::VectorXd& load, Vec x) = 0;
  /// C = E^T K^-1 E, on every rank; computed at the first call.
  virtual const Eigen::MatrixXd& compliance() = 0;
  /// Bytes of the factor on this rank, and what it is ("cholmod simplicial LDL^T, METIS").
  virtual double bytes() const = 0;
  virtual double flops() const { return 0; }  ///< floating point operations of the factorization, 0 where not counted
  virtual std::string description() const = 0;

  /// x = K^-1 r.
  void solve(Vec r, Vec x);
  /// Whether K was declared symmetric, and x = K^-T r.
  virtual bool symmetric() const { return true; }
  virtual void solve_transposed(Vec r, Vec x) { solve(r, x); }
  int substitutions() const { return substitutions_; }  ///< forward and backward pairs so far

 protected:
  int substitutions_ = 0;
};

/// Factors `k`. `trailing` are global scalar indices, the same on every rank. On one rank CHOLMOD is used when it is
/// there and the matrix is symmetric, with the trailing unknowns ordered last, so that a step costs exactly one forward
/// and one backward substitution and C comes free with the last block; otherwise PETSc's KSP under `prefix` (default
/// MUMPS). `block` is the number of unknowns a node. Throws std::invalid_argument when the operator is singular, or
/// indefinite where that is refused.
std::unique_ptr<Factor> factor(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, int block,
                               const std::string& prefix, Backend backend = Backend::automatic);

}  // namespace warmslip
