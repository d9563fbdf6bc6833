// CPU time of a stretch of code.
#pragma once
#include <ctime>

namespace warmslip {

/// Adds the CPU seconds of its life to `to`.
class Timed {
 public:
  explicit Timed(double& to) : to_(to), begin_(now()) {}
  ~Timed() { to_ += now() - begin_; }
  Timed(const Timed&) = delete;

 private:
  static double now() {
    timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double& to_;
  double begin_;
};

}  // namespace warmslip
