// The steady state of a Kalman filter of a few states and one measurement, of the first state. For the host:
// coefficients are made there.
#pragma once

#include <array>
#include <cstddef>

namespace flexspline::observers {

template <class P, std::size_t n>
using Matrix = std::array<std::array<P, n>, n>;
template <class P>
using Matrix3 = Matrix<P, 3>;

namespace detail {
template <class P, std::size_t n, class Entry>
Matrix<P, n> filled(Entry&& entry) {
  Matrix<P, n> m{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) m[i][j] = entry(i, j);
  return m;
}
template <class P, std::size_t n>
Matrix<P, n> product(const Matrix<P, n>& a, const Matrix<P, n>& b) {
  return filled<P, n>([&](std::size_t i, std::size_t j) {
    P sum(0.0);
    for (std::size_t k = 0; k < n; ++k) sum = sum + a[i][k] * b[k][j];
    return sum;
  });
}
template <class P, std::size_t n>
Matrix<P, n> sum(const Matrix<P, n>& a, const Matrix<P, n>& b) {
  return filled<P, n>([&](std::size_t i, std::size_t j) { return a[i][j] + b[i][j]; });
}
template <class P, std::size_t n>
Matrix<P, n> transposed(const Matrix<P, n>& a) {
  return filled<P, n>([&](std::size_t i, std::size_t j) { return a[j][i]; });
}
template <class P>
P size_of(const P& x) {
  return x < P(0.0) ? -x : x;
}
// a^-1 b, by elimination with the largest pivot.
template <class P, std::size_t n>
Matrix<P, n> solved(Matrix<P, n> a, Matrix<P, n> b) {
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (size_of(a[i][k]) > size_of(a[best][k])) best = i;
    const auto row = a[k], right = b[k];
    a[k] = a[best];
    b[k] = b[best];
    a[best] = row;
    b[best] = right;
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k) continue;
      const P factor = a[i][k] / a[k][k];
      for (std::size_t j = 0; j < n; ++j) {
        a[i][j] = a[i][j] - factor * a[k][j];
        b[i][j] = b[i][j] - factor * b[k][j];
      }
    }
  }
  return filled<P, n>([&](std::size_t i, std::size_t j) { return b[i][j] / a[i][i]; });
}
}  // namespace detail

// The steady-state covariance before a measurement, P, of x' = A x + w, y = x_0 + v, with the covariance Q of w and the
// variance R of v:
//   P = A (P - P c' (c P c' + R)^-1 c P) A' + Q,  c = (1 0 ...).
// Each step of the structure-preserving doubling algorithm (Chu, Fan, Lin and Wang, 2004) doubles the number of ticks,
// so that filters with time constants of a million ticks are solved as well.
template <class P, std::size_t n>
Matrix<P, n> steady_covariance(const Matrix<P, n>& a, const Matrix<P, n>& q, const P& r) {
  constexpr int kMostDoublings = 64;
  const Matrix<P, n> one = detail::filled<P, n>([](std::size_t i, std::size_t j) { return P(i == j ? 1.0 : 0.0); });
  Matrix<P, n> f = detail::transposed(a);
  Matrix<P, n> g{};
  g[0][0] = P(1.0) / r;
  Matrix<P, n> h = q;
  for (int k = 0; k < kMostDoublings; ++k) {
    const Matrix<P, n> w = detail::sum(one, detail::product(g, h));
    const Matrix<P, n> w_f = detail::solved(w, f);
    const Matrix<P, n> w_g = detail::solved(w, g);
    const Matrix<P, n> more = detail::product(detail::transposed(f), detail::product(h, w_f));
    g = detail::sum(g, detail::product(f, detail::product(w_g, detail::transposed(f))));
    f = detail::product(f, w_f);
    h = detail::sum(h, more);
    // Keeps the matrix symmetric in spite of round-off.
    const Matrix<P, n> turned = detail::transposed(h);
    h = detail::filled<P, n>([&](std::size_t i, std::size_t j) { return P(0.5) * (h[i][j] + turned[i][j]); });
    if (!(detail::size_of(more[0][0]) > P(1e-17) * h[0][0] ||
          detail::size_of(more[n - 1][n - 1]) > P(1e-17) * h[n - 1][n - 1]))
      break;
  }
  return h;
}

// The filter's gain for each state: P c' / (c P c' + R).
template <class P, std::size_t n>
std::array<P, n> steady_gain(const Matrix<P, n>& covariance, const P& r) {
  std::array<P, n> gain{};
  for (std::size_t i = 0; i < n; ++i) gain[i] = covariance[i][0] / (covariance[0][0] + r);
  return gain;
}

}  // namespace flexspline::observers
