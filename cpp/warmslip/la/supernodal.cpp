#include "warmslip/la/supernodal.hpp"

#include <algorithm>
#include <cstddef>

// one copy of the sweeps for processors with wide vectors, one for all others, chosen at run time
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define WARMSLIP_WIDE __attribute__((target_clones("arch=haswell", "default")))
#else
#define WARMSLIP_WIDE
#endif

namespace warmslip {
namespace {

#define WARMSLIP_INLINE inline __attribute__((always_inline))

// A sweep fetches its factor this many entries ahead: the processor does not guess a place beyond a page, nor in a
// sweep that runs towards lower addresses. A factor that caches hold is there already.
constexpr std::ptrdiff_t ahead = 2048, chunk = 64;
constexpr double cached_bytes = 1e6;

WARMSLIP_INLINE void fetch(const double* at, std::ptrdiff_t entries) {
  for (std::ptrdiff_t i = 0; i < entries; i += 8) __builtin_prefetch(at + i);
}

// t = A x, or t += A x after the first columns, for `rows` x `columns` A by columns
template <int columns, bool first, bool far>
WARMSLIP_INLINE void add_columns(const double* __restrict a, std::ptrdiff_t rows, const double* __restrict x,
                                 double* __restrict t) {
  for (std::ptrdiff_t from = 0; from < rows; from += chunk) {
    const std::ptrdiff_t end = std::min(rows, from + chunk);
    if constexpr (far) fetch(a + columns * from + ahead, columns * (end - from));
    for (std::ptrdiff_t i = from; i < end; ++i) {
      double sum = a[i] * x[0];
      if constexpr (columns > 1) sum += a[rows + i] * x[1];
      if constexpr (columns > 2) sum += a[2 * rows + i] * x[2];
      if constexpr (columns > 3) sum += a[3 * rows + i] * x[3];
      t[i] = first ? sum : t[i] + sum;
    }
  }
}

// t = A x for `rows` x `width` A by columns, four columns a pass
template <bool far>
WARMSLIP_INLINE void multiply(const double* __restrict a, std::ptrdiff_t rows, int width, const double* __restrict x,
                              double* __restrict t) {
  int j = 0;
  if (width >= 4) {
    add_columns<4, true, far>(a, rows, x, t);
    j = 4;
  } else if (width >= 2) {
    add_columns<2, true, far>(a, rows, x, t);
    j = 2;
  } else {
    add_columns<1, true, far>(a, rows, x, t);
    j = 1;
  }
  for (; j + 4 <= width; j += 4) add_columns<4, false, far>(a + j * rows, rows, x + j, t);
  if (j + 2 <= width) {
    add_columns<2, false, far>(a + j * rows, rows, x + j, t);
    j += 2;
  }
  if (j < width) add_columns<1, false, far>(a + j * rows, rows, x + j, t);
}

// a . t, four sums at a time so that additions overlap
WARMSLIP_INLINE double dot(const double* __restrict a, const double* __restrict t, std::ptrdiff_t rows) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::ptrdiff_t i = 0;
  for (; i + 4 <= rows; i += 4) {
    s0 += a[i] * t[i];
    s1 += a[i + 1] * t[i + 1];
    s2 += a[i + 2] * t[i + 2];
    s3 += a[i + 3] * t[i + 3];
  }
  for (; i < rows; ++i) s0 += a[i] * t[i];
  return (s0 + s1) + (s2 + s3);
}

// x -= A^T t, four columns a pass, from the last column to the first: towards lower addresses, as the sweep runs
template <bool far>
WARMSLIP_INLINE void subtract_transposed(const double* __restrict a, std::ptrdiff_t rows, int width,
                                         const double* __restrict t, double* __restrict x) {
  int j = width;
  a += width * rows;
  for (; j % 4; --j) {
    a -= rows;
    if constexpr (far) fetch(a - ahead, rows);
    x[j - 1] -= dot(a, t, rows);
  }
  for (; j > 0; j -= 4) {
    a -= 4 * rows;
    const double *a0 = a, *a1 = a0 + rows, *a2 = a1 + rows, *a3 = a2 + rows;
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    for (std::ptrdiff_t from = 0; from < rows; from += chunk) {
      const std::ptrdiff_t end = std::min(rows, from + chunk);
      if constexpr (far) fetch(a + 4 * (rows - end) - ahead, 4 * (end - from));
#pragma omp simd reduction(+ : s0, s1, s2, s3)
      for (std::ptrdiff_t i = from; i < end; ++i) {
        s0 += a0[i] * t[i];
        s1 += a1[i] * t[i];
        s2 += a2[i] * t[i];
        s3 += a3[i] * t[i];
      }
    }
    x[j - 4] -= s0;
    x[j - 3] -= s1;
    x[j - 2] -= s2;
    x[j - 1] -= s3;
  }
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

template <bool far>
WARMSLIP_INLINE void Panels::sweep_forward(double* x) const {
  double* t = work_.data();
  for (const Panel& p : panels_) {
    const double* a = values_.data() + p.value;
    double* x_panel = x + p.first;
    for (int j = 0; j < p.width; ++j) {
      if constexpr (far) fetch(a + ahead, p.width - 1 - j);
      for (int i = j + 1; i < p.width; ++i) x_panel[i] -= *a++ * x_panel[j];
    }
    multiply<far>(a, p.rows, p.width, x_panel, t);
    const int* rows = rows_.data() + p.row;
    for (int i = 0; i < p.rows; ++i) x[rows[i]] -= t[i];
  }
}

template <bool far>
WARMSLIP_INLINE void Panels::sweep_backward(double* x) const {
  double* t = work_.data();
  for (std::size_t at = panels_.size(); at-- > 0;) {
    const Panel& p = panels_[at];
    const auto width = static_cast<std::size_t>(p.width), triangle = width * (width - 1) / 2;
    const double* inverse_pivots = inverse_pivots_.data() + p.first;
    const double* a = values_.data() + p.value + triangle;
    const int* rows = rows_.data() + p.row;
    double* x_panel = x + p.first;
    for (int i = 0; i < p.rows; ++i) t[i] = x[rows[i]];
    for (int j = 0; j < p.width; ++j) x_panel[j] *= inverse_pivots[j];
    subtract_transposed<far>(a, p.rows, p.width, t, x_panel);
    for (int j = p.width - 2; j >= 0; --j) {
      const int below = p.width - 1 - j;
      a -= below;
      if constexpr (far) fetch(a - ahead, below);
      x_panel[j] -= dot(a, x_panel + j + 1, below);
    }
  }
}

WARMSLIP_WIDE void Panels::forward(double* x) const {
  if (bytes() > cached_bytes)
    sweep_forward<true>(x);
  else
    sweep_forward<false>(x);
}

WARMSLIP_WIDE void Panels::backward(double* x) const {
  if (bytes() > cached_bytes)
    sweep_backward<true>(x);
  else
    sweep_backward<false>(x);
}

double Panels::bytes() const {
  return 8.0 * static_cast<double>(values_.size() + inverse_pivots_.size()) + 4.0 * static_cast<double>(rows_.size()) +
         static_cast<double>(sizeof(Panel) * panels_.size());
}

}  // namespace warmslip
