// Divisions by zero, overflows and invalid operations stop the program, where the data give no reason for any.
#pragma once
#include <cfenv>

namespace warmslip {

/// Traps for as long as it lives; doctest names the test that was stopped, gdb the line.
struct Trapping {
  Trapping() { feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW); }
  ~Trapping() {
    fedisableexcept(FE_ALL_EXCEPT);
    feclearexcept(FE_ALL_EXCEPT);
  }
  Trapping(const Trapping&) = delete;
};

}  // namespace warmslip
