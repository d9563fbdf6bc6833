#include "warmslip/la/supernodal.hpp"

#include <algorithm>

// one copy of the sweeps for processors with wide vectors, one for all others, chosen at run time
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define WARMSLIP_WIDE __attribute__((target_clones("arch=haswell", "default")))
#else
#define WARMSLIP_WIDE
#endif

namespace warmslip {
namespace {

// t += A x for `rows` x `width` A by columns, four columns a pass
inline __attribute__((always_inline)) void multiply(const double* __restrict a, int rows, int width,
                                                    const double* __restrict x, double* __restrict t) {
  int j = 0;
  for (; j + 4 <= width; j += 4, a += 4 * static_cast<std::size_t>(rows)) {
    const double *a0 = a, *a1 = a0 + rows, *a2 = a1 + rows, *a3 = a2 + rows;
    const double x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];
    for (int i = 0; i < rows; ++i) t[i] += a0[i] * x0 + a1[i] * x1 + a2[i] * x2 + a3[i] * x3;
  }
  for (; j + 2 <= width; j += 2, a += 2 * static_cast<std::size_t>(rows)) {
    const double *a0 = a, *a1 = a0 + rows;
    const double x0 = x[j], x1 = x[j + 1];
    for (int i = 0; i < rows; ++i) t[i] += a0[i] * x0 + a1[i] * x1;
  }
  if (j < width)
    for (int i = 0; i < rows; ++i) t[i] += a[i] * x[j];
}

// a . t, two sums at a time so that additions overlap
inline __attribute__((always_inline)) double dot(const double* __restrict a, const double* __restrict t, int rows) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  int i = 0;
  for (; i + 4 <= rows; i += 4) {
    s0 += a[i] * t[i];
    s1 += a[i + 1] * t[i + 1];
    s2 += a[i + 2] * t[i + 2];
    s3 += a[i + 3] * t[i + 3];
  }
  for (; i < rows; ++i) s0 += a[i] * t[i];
  return (s0 + s1) + (s2 + s3);
}

}  // namespace

Panels::Panels(std::size_t n, const int* start, const int* count, const int* index, const double* value)
    : inverse_pivots_(n) {
  int longest = 0;
  const auto end_of = [&](std::size_t first) {
    std::size_t end = first + 1;
    // column j+1 continues the panel when it is the first row of column j and has every other row of it
    while (end < n && count[end] == count[end - 1] - 1 && index[start[end - 1] + 1] == static_cast<int>(end)) ++end;
    return end;
  };
  std::size_t entries_below = 0, rows_below = 0;  // growing to them by insertion would take twice their room
  for (std::size_t j = 0; j < n; ++j) entries_below += static_cast<std::size_t>(count[j] - 1);
  for (std::size_t first = 0; first < n; first = end_of(first))
    rows_below += static_cast<std::size_t>(count[end_of(first) - 1] - 1);
  values_.reserve(entries_below);
  rows_.reserve(rows_below);
  for (std::size_t first = 0; first < n;) {
    const std::size_t end = end_of(first);
    const int width = static_cast<int>(end - first), below = count[end - 1] - 1;
    panels_.push_back({static_cast<int>(first), width, below, rows_.size(), values_.size()});
    const int* last = index + start[end - 1] + 1;
    rows_.insert(rows_.end(), last, last + below);
    for (std::size_t j = first; j < end; ++j) {
      inverse_pivots_[j] = 1 / value[start[j]];
      const double* entries = value + start[j] + 1;
      values_.insert(values_.end(), entries, entries + (end - j - 1));
    }
    for (std::size_t j = first; j < end; ++j) {
      const double* entries = value + start[j] + (end - j);
      values_.insert(values_.end(), entries, entries + below);
    }
    longest = std::max(longest, below);
    first = end;
  }
  work_.resize(static_cast<std::size_t>(longest));
}

WARMSLIP_WIDE void Panels::forward(double* x) const {
  double* t = work_.data();
  for (const Panel& p : panels_) {
    const double* a = values_.data() + p.value;
    double* x_panel = x + p.first;
    for (int j = 0; j < p.width; ++j)
      for (int i = j + 1; i < p.width; ++i) x_panel[i] -= *a++ * x_panel[j];
    std::fill(t, t + p.rows, 0.0);
    multiply(a, p.rows, p.width, x_panel, t);
    const int* rows = rows_.data() + p.row;
    for (int i = 0; i < p.rows; ++i) x[rows[i]] -= t[i];
  }
}

WARMSLIP_WIDE void Panels::backward(double* x) const {
  double* t = work_.data();
  for (std::size_t at = panels_.size(); at-- > 0;) {
    const Panel& p = panels_[at];
    const auto width = static_cast<std::size_t>(p.width), triangle = width * (width - 1) / 2;
    const double* inverse_pivots = inverse_pivots_.data() + p.first;
    const double* a = values_.data() + p.value + triangle;
    const int* rows = rows_.data() + p.row;
    double* x_panel = x + p.first;
    for (int i = 0; i < p.rows; ++i) t[i] = x[rows[i]];
    for (int j = 0; j < p.width; ++j) {
      x_panel[j] = x_panel[j] * inverse_pivots[j] - dot(a, t, p.rows);
      a += p.rows;
    }
    a = values_.data() + p.value + triangle;
    for (int j = p.width - 2; j >= 0; --j) {
      a -= p.width - 1 - j;
      x_panel[j] -= dot(a, x_panel + j + 1, p.width - 1 - j);
    }
  }
}

double Panels::bytes() const {
  return 8.0 * static_cast<double>(values_.size() + inverse_pivots_.size()) + 4.0 * static_cast<double>(rows_.size()) +
         static_cast<double>(sizeof(Panel) * panels_.size());
}

}  // namespace warmslip
