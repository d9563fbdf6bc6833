// Owning handles for PETSc objects, and its error codes as exceptions.
#pragma once
#include <petscksp.h>

#include <Eigen/Dense>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace warmslip {

/// A PETSc call that failed; `code` is PETSc's.
struct PetscFailure : std::runtime_error {
  PetscFailure(int petsc_code, const std::string& where);
  int code;
};

/// A linear solve that did not reach its answer; the message is a sentence with the cure.
struct SolveFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws PetscFailure unless `error` is success.
void check(PetscErrorCode error, const char* where);
#define WARMSLIP_PETSC(call) ::warmslip::check((call), #call)

template <class T, auto destroy>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T object) : object_(object) {}
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Handle() {
    if (object_) destroy(&object_);
  }
  operator T() const { return object_; }
  /// For PETSc's creating functions.
  T* out() { return &object_; }

 private:
  T object_ = nullptr;
};

/// Destroys a solver. Its destruction is collective, and an owner in Python may be collected at another time on every
/// rank: with several ranks the solver is put aside until `free_what_all_ranks_dropped`.
PetscErrorCode destroy_together(KSP* ksp);

/// Destroys the solvers that every rank has put aside (collective).
void free_what_all_ranks_dropped(MPI_Comm comm);

using VecHandle = Handle<Vec, VecDestroy>;
using MatHandle = Handle<Mat, MatDestroy>;
using KspHandle = Handle<KSP, destroy_together>;
using IsHandle = Handle<IS, ISDestroy>;
using ScatterHandle = Handle<VecScatter, VecScatterDestroy>;

/// A copy of the layout of `like`, not of its values.
VecHandle duplicate(Vec like);

/// Unknowns a node.
Eigen::Index block_size(Vec v);

/// y = a x; nothing when there is no such operator.
void multiply(Mat a, Vec x, Vec y);

/// A view of a vector's own entries as an Eigen array, for reading or writing; returned to PETSc on destruction. Of no
/// vector: no entries.
class Values {
 public:
  explicit Values(Vec vec);
  Values(const Values&) = delete;
  ~Values();
  Eigen::Map<Eigen::VectorXd> operator*() { return {data_, size_}; }

 private:
  Vec vec_;
  double* data_ = nullptr;
  PetscInt size_ = 0;
};

}  // namespace warmslip
