#include "warmslip/la/factor_backends.hpp"

namespace warmslip {
namespace {

class PetscFactor final : public Factor {
 public:
  PetscFactor(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, const std::string& prefix)
      : prefix_(prefix), symmetric_(symmetry != Symmetry::general) {
    const MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(k));
    const bool counted = symmetry == Symmetry::definite_or_refused,
               cholesky = counted || symmetry == Symmetry::positive_definite;
    free_what_all_ranks_dropped(comm);
    WARMSLIP_PETSC(KSPCreate(comm, ksp_.out()));
    WARMSLIP_PETSC(KSPSetOptionsPrefix(ksp_, (prefix + "_").c_str()));
    WARMSLIP_PETSC(KSPSetOperators(ksp_, k, k));
    WARMSLIP_PETSC(KSPSetType(ksp_, KSPPREONLY));
    WARMSLIP_PETSC(MatSetOption(k, MAT_SYMMETRIC, symmetry == Symmetry::general ? PETSC_FALSE : PETSC_TRUE));
    if (cholesky && !counted) WARMSLIP_PETSC(MatSetOption(k, MAT_SPD, PETSC_TRUE));
    PC pc;
    WARMSLIP_PETSC(KSPGetPC(ksp_, &pc));
    WARMSLIP_PETSC(PCSetType(pc, cholesky ? PCCHOLESKY : PCLU));
    WARMSLIP_PETSC(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    WARMSLIP_PETSC(KSPSetFromOptions(ksp_));
    WARMSLIP_PETSC(KSPSetUp(ksp_));
    if (reason() < 0)
      throw std::invalid_argument("the " + prefix +
                                  " operator could not be factored: it is singular or its entries "
                                  "are out of range; check the material, the supports and the time step");
    if (counted && negative_pivots() > 0) throw std::invalid_argument(indefinite_coupling);
    WARMSLIP_PETSC(MatCreateVecs(k, free_.out(), right_.out()));
    work_ = duplicate(right_);

    WARMSLIP_PETSC(ISCreateGeneral(PETSC_COMM_SELF, static_cast<PetscInt>(trailing.size()), trailing.data(),
                                   PETSC_COPY_VALUES, indices_.out()));
    WARMSLIP_PETSC(VecCreateSeq(PETSC_COMM_SELF, static_cast<PetscInt>(trailing.size()), held_.out()));
    WARMSLIP_PETSC(VecScatterCreate(free_, indices_, held_, nullptr, scatter_.out()));
    trailing_ = trailing;
  }

  Eigen::VectorXd reduce(Vec r) override {
    WARMSLIP_PETSC(VecCopy(r, right_));
    solve_for(right_, free_);
    return held(free_);
  }

  void expand(const Eigen::VectorXd& load, Vec x) override {
    if (load.size() == 0 || load.isZero(0)) {
      WARMSLIP_PETSC(VecCopy(free_, x));
      return;
    }
    add_load(load);
    solve_for(work_, x);
    WARMSLIP_PETSC(VecAYPX(x, -1, free_));
  }

  bool symmetric() const override { return symmetric_; }

  void solve_transposed(Vec r, Vec x) override {
    WARMSLIP_PETSC(VecCopy(r, right_));
    WARMSLIP_PETSC(KSPSolveTranspose(ksp_, right_, x));
    count_solve();
  }

  const Eigen::MatrixXd& compliance() override {
    const auto n = static_cast<Eigen::Index>(trailing_.size());
    if (compliance_.rows() == n) return compliance_;
    compliance_.resize(n, n);
    if (direct()) {
      for (Eigen::Index first = 0; first < n; first += columns_at_once)
        compliance_of(first, std::min(n - first, columns_at_once));
      return compliance_;
    }
    const VecHandle column = duplicate(free_);
    for (Eigen::Index j = 0; j < n; ++j) {
      add_load(Eigen::VectorXd::Unit(n, j));
      solve_for(work_, column);
      compliance_.col(j) = held(column);
    }
    return compliance_;
  }

  double bytes() const override {
    if (!direct()) return 0;
    PC pc;
    Mat factored;
    MatInfo info;
    WARMSLIP_PETSC(KSPGetPC(ksp_, &pc));
    WARMSLIP_PETSC(PCFactorGetMatrix(pc, &factored));
    WARMSLIP_PETSC(MatGetInfo(factored, MAT_LOCAL, &info));
    return 12 * info.nz_used;
  }

  std::string description() const override {
    PC pc;
    PCType type;
    MatSolverType package = nullptr;
    WARMSLIP_PETSC(KSPGetPC(ksp_, &pc));
    WARMSLIP_PETSC(PCGetType(pc, &type));
    if (direct()) WARMSLIP_PETSC(PCFactorGetMatSolverType(pc, &package));
    return std::string("PETSc ") + type + (package ? std::string(" by ") + package : "");
  }

 private:
  static constexpr Eigen::Index columns_at_once = 64;

  // Columns of the compliance by one pass over the factor.
  void compliance_of(Eigen::Index first, Eigen::Index count) {
    PetscInt begin, end;
    WARMSLIP_PETSC(VecGetOwnershipRange(work_, &begin, &end));
    MatHandle loads, velocities;
    const MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(KSP(ksp_)));
    for (MatHandle* block : {&loads, &velocities})
      WARMSLIP_PETSC(MatCreateDense(comm, end - begin, PETSC_DECIDE, PETSC_DETERMINE, static_cast<PetscInt>(count),
                                    nullptr, block->out()));
    for (Eigen::Index j = 0; j < count; ++j) {
      const PetscInt row = trailing_[static_cast<std::size_t>(first + j)];
      if (row >= begin && row < end)
        WARMSLIP_PETSC(MatSetValue(loads, row, static_cast<PetscInt>(j), 1, INSERT_VALUES));
    }
    for (const Mat block : {Mat(loads), Mat(velocities)}) {
      WARMSLIP_PETSC(MatAssemblyBegin(block, MAT_FINAL_ASSEMBLY));
      WARMSLIP_PETSC(MatAssemblyEnd(block, MAT_FINAL_ASSEMBLY));
    }
    WARMSLIP_PETSC(KSPMatSolve(ksp_, loads, velocities));
    count_solve();
    substitutions_ += static_cast<int>(count) - 1;
    for (Eigen::Index j = 0; j < count; ++j) {
      Vec column;
      WARMSLIP_PETSC(MatDenseGetColumnVecRead(velocities, static_cast<PetscInt>(j), &column));
      compliance_.col(first + j) = held(column);
      WARMSLIP_PETSC(MatDenseRestoreColumnVecRead(velocities, static_cast<PetscInt>(j), &column));
    }
  }

  int reason() const {
    KSPConvergedReason reason;
    WARMSLIP_PETSC(KSPGetConvergedReason(ksp_, &reason));
    return reason;
  }

  void solve_for(Vec right, Vec x) {
    WARMSLIP_PETSC(KSPSolve(ksp_, right, x));
    count_solve();
  }

  void count_solve() {
    ++substitutions_;
    if (reason() < 0)
      throw SolveFailed("the " + prefix_ + " solver ended with " + KSPConvergedReasons[reason()] +
                        "; change the PETSc options that start with " + prefix_ + "_");
  }

  // counted by MUMPS; none where another solver was chosen
  PetscInt negative_pivots() const {
    PC pc;
    Mat factored;
    MatSolverType package = nullptr;
    WARMSLIP_PETSC(KSPGetPC(ksp_, &pc));
    if (!direct()) return 0;
    WARMSLIP_PETSC(PCFactorGetMatSolverType(pc, &package));
    if (!package || std::string(package) != MATSOLVERMUMPS) return 0;
    WARMSLIP_PETSC(PCFactorGetMatrix(pc, &factored));
    PetscInt count = 0;
    WARMSLIP_PETSC(MatMumpsGetInfog(factored, 12, &count));
    return count;
  }

  // a direct solver, unless the options say otherwise
  bool direct() const {
    PC pc;
    PetscBool lu, cholesky;
    WARMSLIP_PETSC(KSPGetPC(ksp_, &pc));
    WARMSLIP_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCLU, &lu));
    WARMSLIP_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCCHOLESKY, &cholesky));
    return lu || cholesky;
  }

  Eigen::VectorXd held(Vec from) {
    WARMSLIP_PETSC(VecScatterBegin(scatter_, from, held_, INSERT_VALUES, SCATTER_FORWARD));
    WARMSLIP_PETSC(VecScatterEnd(scatter_, from, held_, INSERT_VALUES, SCATTER_FORWARD));
    return *Values(held_);
  }

  void add_load(const Eigen::VectorXd& load) {
    PetscInt begin, end;
    WARMSLIP_PETSC(VecGetOwnershipRange(work_, &begin, &end));
    WARMSLIP_PETSC(VecSet(work_, 0));
    Values values(work_);
    for (std::size_t i = 0; i < trailing_.size(); ++i)
      if (trailing_[i] >= begin && trailing_[i] < end)
        (*values)[trailing_[i] - begin] = load[static_cast<Eigen::Index>(i)];
  }

  std::string prefix_;
  bool symmetric_;
  KspHandle ksp_;
  VecHandle right_, free_, work_, held_;
  IsHandle indices_;
  ScatterHandle scatter_;
  std::vector<PetscInt> trailing_;
  Eigen::MatrixXd compliance_;
};

}  // namespace

std::unique_ptr<Factor> factor_with_petsc(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry,
                                          const std::string& prefix) {
  return std::make_unique<PetscFactor>(k, trailing, symmetry, prefix);
}

}  // namespace warmslip
