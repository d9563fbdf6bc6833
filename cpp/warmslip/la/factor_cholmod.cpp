#include "warmslip/la/factor_backends.hpp"

#ifndef WARMSLIP_HAVE_CHOLMOD
namespace warmslip {
std::unique_ptr<Factor> factor_with_cholmod(Mat, const std::vector<PetscInt>&, Symmetry, int) { return nullptr; }
}  // namespace warmslip
#else
#include <suitesparse/cholmod.h>

// of the OpenMP library that CHOLMOD may be linked with
extern "C" {
__attribute__((weak)) int omp_get_max_active_levels();
__attribute__((weak)) void omp_set_max_active_levels(int);
}

#include <algorithm>

#include "warmslip/la/supernodal.hpp"

namespace warmslip {
namespace {

// The upper triangle of a sequential AIJ matrix, rows in place of columns, as CHOLMOD reads the lower one.
struct Triangle {
  explicit Triangle(Mat k) {
    PetscInt n;
    const PetscInt *rows, *cols;
    PetscBool done;
    const PetscScalar* entries;
    WARMSLIP_PETSC(MatGetRowIJ(k, 0, PETSC_FALSE, PETSC_FALSE, &n, &rows, &cols, &done));
    if (!done) throw std::logic_error("the CHOLMOD backend needs an assembled AIJ matrix");
    WARMSLIP_PETSC(MatSeqAIJGetArrayRead(k, &entries));
    start.reserve(static_cast<std::size_t>(n) + 1);
    for (PetscInt i = 0; i < n; ++i) {
      start.push_back(static_cast<int>(index.size()));
      for (PetscInt e = rows[i]; e < rows[i + 1]; ++e)
        if (cols[e] >= i && (entries[e] != 0 || cols[e] == i)) {
          index.push_back(static_cast<int>(cols[e]));
          value.push_back(entries[e]);
        }
    }
    start.push_back(static_cast<int>(index.size()));
    WARMSLIP_PETSC(MatSeqAIJRestoreArrayRead(k, &entries));
    WARMSLIP_PETSC(MatRestoreRowIJ(k, 0, PETSC_FALSE, PETSC_FALSE, &n, &rows, &cols, &done));
  }
  std::vector<int> start, index;
  std::vector<double> value;
};

cholmod_sparse view(std::vector<int>& start, std::vector<int>& index, double* value) {
  cholmod_sparse a{};
  a.nrow = a.ncol = start.size() - 1;
  a.nzmax = index.size();
  a.p = start.data();
  a.i = index.data();
  a.x = value;
  a.stype = -1;
  a.itype = CHOLMOD_INT;
  a.xtype = value ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = 1;
  a.packed = 1;
  return a;
}

// CHOLMOD asks for threads of its own, whatever OMP_NUM_THREADS says, and they wait by spinning: parallelism is by
// processes here. While this lives, parallel regions of OpenMP are run by one thread.
class OneThread {
 public:
  OneThread() : levels_(omp_get_max_active_levels ? omp_get_max_active_levels() : 0) { set(0); }
  ~OneThread() { set(levels_); }
  OneThread(const OneThread&) = delete;

 private:
  static void set(int levels) {
    if (omp_set_max_active_levels) omp_set_max_active_levels(levels);
  }
  int levels_;
};

// CHOLMOD's own data and its factor, freed also when memory runs out on the way.
struct Workspace : cholmod_common {
  Workspace() : cholmod_common{} { cholmod_start(this); }
  ~Workspace() { cholmod_finish(this); }
  Workspace(const Workspace&) = delete;
};

struct Release {
  Workspace* common;
  void operator()(cholmod_factor* factor) const { cholmod_free_factor(&factor, common); }
};
using CholmodHandle = std::unique_ptr<cholmod_factor, Release>;

class CholmodFactor final : public Factor {
 public:
  CholmodFactor(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry, int block) {
    const OneThread one_thread;
    common_.print = 0;
    Triangle triangle(k);
    const auto n = triangle.start.size() - 1;
    permutation_ = ordering(triangle, trailing, static_cast<int>(n), block);
    held_ = static_cast<Eigen::Index>(trailing.size());
    interior_ = static_cast<Eigen::Index>(n) - held_;

    cholmod_sparse a = view(triangle.start, triangle.index, triangle.value.data());
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    common_.postorder = 0;  // it would move the trailing unknowns
    // A symmetric matrix that may be indefinite (quasi-definite) needs L D L^T from the start; a definite one is
    // factored quicker in dense blocks as L L^T and then brought to the same form.
    const bool definite = symmetry == Symmetry::positive_definite || symmetry == Symmetry::definite_or_refused;
    common_.supernodal = definite ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    for (int i = 0; i < 3; ++i) common_.nrelax[i] = 0, common_.zrelax[i] = 0;  // every stored zero would be substituted
    factor_.reset(cholmod_analyze_p(&a, permutation_.data(), nullptr, 0, &common_));
    usable_ = factor_ && cholmod_factorize(&a, factor_.get(), &common_) && common_.status == CHOLMOD_OK &&
              factor_->minor == n;
    usable_ = usable_ && cholmod_change_factor(CHOLMOD_REAL, 0, 0, 1, 1, factor_.get(), &common_);
    if (!usable_) return;
    last_block();
    panels_ = Panels(n, static_cast<const int*>(factor_->p), static_cast<const int*>(factor_->nz),
                     static_cast<const int*>(factor_->i), static_cast<const double*>(factor_->x));
    factor_.reset();
    half_.resize(static_cast<Eigen::Index>(n));
    usable_ = accurate(k);
    substitutions_ = 0;
  }

  bool usable() const { return usable_; }

  Eigen::VectorXd reduce(Vec r) override {
    {
      Values values(r);
      for (std::size_t i = 0; i < permutation_.size(); ++i)
        half_[static_cast<Eigen::Index>(i)] = (*values)[permutation_[i]];
    }
    panels_.forward(half_.data());
    ++substitutions_;
    return last_.transpose().triangularView<Eigen::UnitUpper>().solve(half_.tail(held_).cwiseQuotient(pivots_));
  }

  void expand(const Eigen::VectorXd& load, Vec x) override {
    if (held_ > 0) half_.tail(held_) -= last_.triangularView<Eigen::UnitLower>().solve(load);
    panels_.backward(half_.data());
    Values values(x);
    for (std::size_t i = 0; i < permutation_.size(); ++i)
      (*values)[permutation_[i]] = half_[static_cast<Eigen::Index>(i)];
  }

  const Eigen::MatrixXd& compliance() override {
    if (compliance_.rows() == held_) return compliance_;
    Eigen::MatrixXd inverse = last_.triangularView<Eigen::UnitLower>().solve(Eigen::MatrixXd::Identity(held_, held_));
    compliance_.noalias() = inverse.transpose() * pivots_.cwiseInverse().asDiagonal() * inverse;
    return compliance_;
  }

  double bytes() const override { return panels_.bytes(); }
  double flops() const override { return common_.fl; }
  std::string description() const override {
    return std::string("CHOLMOD L D L^T, ") + (metis_ ? "METIS" : "AMD") + " ordering, contact unknowns last";
  }

 private:
  // Isolated (prescribed) unknowns, then the interior nodes by nested dissection of the node graph, then the trailing
  // ones.
  std::vector<int> ordering(const Triangle& a, const std::vector<PetscInt>& trailing, int n, int block) {
    std::vector<bool> last(static_cast<std::size_t>(n), false);
    for (const PetscInt i : trailing) last[static_cast<std::size_t>(i)] = true;
    const int nodes = n / block;
    std::vector<bool> touches(static_cast<std::size_t>(nodes), false);
    for (const PetscInt i : trailing) touches[static_cast<std::size_t>(i / block)] = true;
    std::vector<int> number(static_cast<std::size_t>(nodes), -1), interior;
    for (int i = 0; i < nodes; ++i)
      if (!touches[static_cast<std::size_t>(i)]) {
        number[static_cast<std::size_t>(i)] = static_cast<int>(interior.size());
        interior.push_back(i);
      }
    std::vector<int> start{0}, index, row;
    for (const int node : interior) {
      row.clear();
      for (int i = node * block; i < (node + 1) * block; ++i)
        for (int e = a.start[static_cast<std::size_t>(i)]; e < a.start[static_cast<std::size_t>(i) + 1]; ++e) {
          const int other = number[static_cast<std::size_t>(a.index[static_cast<std::size_t>(e)] / block)];
          if (other >= 0) row.push_back(other);
        }
      row.push_back(number[static_cast<std::size_t>(node)]);
      std::sort(row.begin(), row.end());
      row.erase(std::unique(row.begin(), row.end()), row.end());
      index.insert(index.end(), row.begin(), row.end());
      start.push_back(static_cast<int>(index.size()));
    }
    std::vector<int> order(interior.size());
    if (!interior.empty()) {
      cholmod_sparse graph = view(start, index, nullptr);
      metis_ = cholmod_metis(&graph, nullptr, 0, 1, order.data(), &common_) && common_.status == CHOLMOD_OK;
      if (!metis_) cholmod_amd(&graph, nullptr, 0, order.data(), &common_);
    }
    std::vector<int> permutation;
    for (const int o : order)
      for (int c = 0; c < block; ++c) permutation.push_back(interior[static_cast<std::size_t>(o)] * block + c);
    for (int i = 0; i < n; ++i)
      if (touches[static_cast<std::size_t>(i / block)] && !last[static_cast<std::size_t>(i)]) permutation.push_back(i);
    for (const PetscInt i : trailing) permutation.push_back(static_cast<int>(i));
    return permutation;
  }

  // The dense last block L_cc and its pivots: S = L_cc D_cc L_cc^T is the Schur complement of the trailing unknowns.
  void last_block() {
    last_ = Eigen::MatrixXd::Identity(held_, held_);
    pivots_.resize(held_);
    const auto* start = static_cast<const int*>(factor_->p);
    const auto* count = static_cast<const int*>(factor_->nz);
    const auto* index = static_cast<const int*>(factor_->i);
    const auto* value = static_cast<const double*>(factor_->x);
    for (Eigen::Index j = 0; j < held_; ++j) {
      const auto column = interior_ + j;
      for (int e = start[column]; e < start[column] + count[column]; ++e) {
        if (index[e] == column)
          pivots_[j] = value[e];
        else
          last_(index[e] - interior_, j) = value[e];
      }
    }
  }

  // One solve as a test: without pivoting an indefinite matrix may lose digits.
  bool accurate(Mat k) {
    VecHandle b, x;
    WARMSLIP_PETSC(MatCreateVecs(k, x.out(), b.out()));
    {
      Values values(b);
      for (Eigen::Index i = 0; i < (*values).size(); ++i) (*values)[i] = static_cast<double>(1 + i * 7 % 11);
    }
    const VecHandle residual = duplicate(b);
    reduce(b);
    expand(Eigen::VectorXd::Zero(held_), x);
    PetscReal size, error, factor_size, solution;
    WARMSLIP_PETSC(MatMult(k, x, residual));
    WARMSLIP_PETSC(VecAXPY(residual, -1, b));
    WARMSLIP_PETSC(VecNorm(b, NORM_INFINITY, &size));
    WARMSLIP_PETSC(VecNorm(x, NORM_INFINITY, &solution));
    WARMSLIP_PETSC(MatNorm(k, NORM_INFINITY, &factor_size));
    WARMSLIP_PETSC(VecNorm(residual, NORM_INFINITY, &error));
    return error <= 1e-12 * (size + factor_size * solution);
  }

  Workspace common_;
  CholmodHandle factor_{nullptr, Release{&common_}};
  Panels panels_;
  Eigen::VectorXd half_;  // the right-hand side, half way
  std::vector<int> permutation_;
  Eigen::Index held_ = 0, interior_ = 0;
  Eigen::MatrixXd last_, compliance_;
  Eigen::VectorXd pivots_;
  bool usable_ = false, metis_ = false;
};

}  // namespace

std::unique_ptr<Factor> factor_with_cholmod(Mat k, const std::vector<PetscInt>& trailing, Symmetry symmetry,
                                            int block) {
  auto factor = std::make_unique<CholmodFactor>(k, trailing, symmetry, block);
  if (!factor->usable()) return nullptr;
  return factor;
}

}  // namespace warmslip
#endif
