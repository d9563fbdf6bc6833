// Memory that runs out. The k-th allocation of the core fails, then that of PETSc, for one k after the other: what was
// begun ends in an exception, leaves nothing behind, and a stepper takes the step later as if nothing had been.
// The core's own allocations are those of this program and of operator new; the linker hands over malloc and its kin.
#include <doctest/doctest.h>

#include <cstdlib>
#include <new>

#include "paper.hpp"
#include "trapping.hpp"

namespace {

long left = -1;   // allocations until one fails; negative: none does
long asked = 0;   // allocations so far
long living = 0;  // that were not freed yet

bool fails() {
  ++asked;
  return left >= 0 && left-- == 0;
}

void* counted(void* given) {
  living += given != nullptr;
  return given;
}

}  // namespace

extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* old, std::size_t size);
void __real_free(void* old);

void* __wrap_malloc(std::size_t size) { return fails() ? nullptr : counted(__real_malloc(size)); }
void* __wrap_calloc(std::size_t count, std::size_t size) {
  return fails() ? nullptr : counted(__real_calloc(count, size));
}
void* __wrap_realloc(void* old, std::size_t size) {
  if (fails()) return nullptr;
  living -= old != nullptr;
  return counted(__real_realloc(old, size));
}
void __wrap_free(void* old) {
  living -= old != nullptr;
  __real_free(old);
}
}

void* operator new(std::size_t size) {
  if (void* given = __wrap_malloc(size > 0 ? size : 1)) return given;
  throw std::bad_alloc();
}
void operator delete(void* old) noexcept { __wrap_free(old); }
void operator delete(void* old, std::size_t) noexcept { __wrap_free(old); }

using namespace warmslip;

namespace {

using Two = std::integral_constant<int, 2>;
using Three = std::integral_constant<int, 3>;

#ifdef __SANITIZE_ADDRESS__
constexpr long thinned = 10;  // the sanitizers see in every tenth what they would see in all
#else
constexpr long thinned = 1;
#endif

/// What an attempt ended in.
enum class End { done, out_of_memory, petsc_out_of_memory };

/// Runs `attempt` with its k-th allocation failing.
template <class Attempt>
End with_failure(long k, const Attempt& attempt) {
  left = k;
  End end = End::done;
  try {
    attempt();
  } catch (const std::bad_alloc&) {
    end = End::out_of_memory;
  } catch (const PetscFailure&) {
    end = End::petsc_out_of_memory;
  }
  left = -1;
  return end;
}

/// How many allocations `attempt` asks for.
template <class Attempt>
long allocations(const Attempt& attempt) {
  const long before = asked;
  attempt();
  return asked - before;
}

decltype(PetscTrMalloc) petsc_malloc;

PetscErrorCode failing_petsc_malloc(std::size_t size, PetscBool clear, int line, const char* function, const char* file,
                                    void** given) {
  if (!fails()) return petsc_malloc(size, clear, line, function, file, given);
  *given = nullptr;
  return PETSC_ERR_MEM;
}

/// While it lives PETSc's allocations are counted and fail as the others do, without PETSc's report.
struct PetscToo {
  PetscToo() {
    petsc_malloc = PetscTrMalloc;
    PetscTrMalloc = failing_petsc_malloc;
    PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  }
  ~PetscToo() {
    PetscTrMalloc = petsc_malloc;
    PetscPopErrorHandler();
  }
};

template <int d>
StepperOptions options(Coupling coupling, bool refine) {
  StepperOptions found{0.25, coupling, Backend::automatic, {}};
  if (refine) found.refinement = -1;
  return found;
}

template <int d>
struct End_of {
  Eigen::VectorXd u, w, theta, force;
  End_of(const PaperProblem<d>& paper, const Stepper<d>& stepper)
      : u(paper.layout.gather(stepper.level().u)),
        w(paper.layout.gather(stepper.level().w)),
        theta(paper.layout.gather(stepper.level().theta)),
        force(stepper.contact_force()) {}
  bool operator==(const End_of& o) const { return u == o.u && w == o.w && theta == o.theta && force == o.force; }
};

/// Every step of a few, with every allocation in it failing once before it is taken.
template <int d>
void check_steps(const PaperProblem<d>& paper, Coupling coupling, bool refine) {
  const Trapping trapping;
  const StepLoads loads = paper.loads();
  Stepper<d> stepper = paper.stepper(options<d>(coupling, refine));
  const auto advance = [&] {
    if (stepper.advance(loads).outcome != Outcome::completed) throw std::runtime_error("the step was not taken");
  };
  const auto before = [&](int steps) {
    paper.start(stepper);
    stepper.resume(Eigen::VectorXd::Zero(stepper.contact_force().size()),
                   std::vector<Status>(stepper.status().size(), Status::open), {}, 0);
    for (int n = 0; n < steps; ++n) advance();
  };
  for (const int steps : {0, 1, 2}) {
    before(steps);
    const End_of<d> began(paper, stepper);
    const long count = allocations(advance);
    const End_of<d> right(paper, stepper);
    const long stride = std::max(1L, count / (200 / thinned));
    CAPTURE(steps);
    CAPTURE(count);
    long tried = 0;
    for (long k = 0; k < count; k += stride) {
      CAPTURE(k);
      before(steps);
      const End end = with_failure(k, advance);
      if (end == End::done) break;  // once taken, some memory is there already
      REQUIRE(end == End::out_of_memory);
      ++tried;
      REQUIRE(End_of<d>(paper, stepper) == began);
      REQUIRE(stepper.time() == 0.25 * steps);
      advance();
      REQUIRE(End_of<d>(paper, stepper) == right);
    }
    REQUIRE(tried >= 15);
  }
}

/// A problem set up from nothing, with about `many` of its allocations failing one after the other.
template <int d>
void check_setup(long many, bool all_freed) {
  const auto set_up = [] {
    const PaperProblem<d> paper(2);
    Stepper<d> stepper = paper.stepper(options<d>(Coupling::staggered, false));
    paper.start(stepper);
  };
  set_up();  // what is made once and kept
  const long count = allocations(set_up);
  CAPTURE(count);
  int tried = 0, failed = 0;
  for (long k = 0; k < count; k += std::max(1L, count / (many / thinned))) {
    CAPTURE(k);
    const long before = living;
    ++tried;
    failed += with_failure(k, set_up) != End::done;
    const long kept = living - before;
    if (all_freed) REQUIRE(kept <= 0);  // what a library has made may be freed here
  }
  REQUIRE(2 * failed > tried);  // some are room that a sort can do without
}

}  // namespace

TEST_CASE_TEMPLATE("a step whose k-th allocation fails is taken later as if nothing had been", D, Two, Three) {
  constexpr int d = D::value;
  const PaperProblem<d> nodal(2), gauss(2, 1, 2), free(2, 1, 0, false);
  check_steps<d>(nodal, Coupling::staggered, false);
  check_steps<d>(nodal, Coupling::monolithic, true);
  check_steps<d>(gauss, Coupling::lagged, false);
  check_steps<d>(free, Coupling::staggered, true);
}

TEST_CASE_TEMPLATE("a problem whose k-th allocation fails leaves nothing behind", D, Two, Three) {
  check_setup<D::value>(1000, true);
}

TEST_CASE_TEMPLATE("a problem in which PETSc's k-th allocation fails ends in an exception", D, Two, Three) {
  const PetscToo failing;
  check_setup<D::value>(100, false);
}
