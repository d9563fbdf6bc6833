// How long a stretch of code takes.
#pragma once
#include <ctime>

namespace warmslip {

/// Adds the seconds of its life to `to`, as a clock counts them.
template <clockid_t clock>
class Timed {
 public:
  explicit Timed(double& to) : to_(to), begin_(now()) {}
  ~Timed() { to_ += now() - begin_; }
  Timed(const Timed&) = delete;

 private:
  static double now() {
    timespec time;
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double& to_;
  double begin_;
};

/// CPU time of this process; to read it is a system call, of which ten took a tenth of a small step.
using CpuTimed = Timed<CLOCK_PROCESS_CPUTIME_ID>;
/// Elapsed time, which takes no system call.
using WallTimed = Timed<CLOCK_MONOTONIC>;

}  // namespace warmslip
