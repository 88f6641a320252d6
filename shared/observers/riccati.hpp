// The steady state of a Kalman filter with three states and one measurement. For the host: coefficients are made there.
#pragma once

#include <array>
#include <cstddef>

namespace flexspline::observers {

template <class P>
using Matrix3 = std::array<std::array<P, 3>, 3>;

namespace detail {
template <class P, class Entry>
Matrix3<P> filled(Entry&& entry) {
  Matrix3<P> m{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = entry(i, j);
  return m;
}
template <class P>
Matrix3<P> product(const Matrix3<P>& a, const Matrix3<P>& b) {
  return filled<P>(
      [&](std::size_t i, std::size_t j) { return a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]; });
}
template <class P>
Matrix3<P> sum(const Matrix3<P>& a, const Matrix3<P>& b) {
  return filled<P>([&](std::size_t i, std::size_t j) { return a[i][j] + b[i][j]; });
}
template <class P>
Matrix3<P> transposed(const Matrix3<P>& a) {
  return filled<P>([&](std::size_t i, std::size_t j) { return a[j][i]; });
}
template <class P>
P size_of(const P& x) {
  return x < P(0.0) ? -x : x;
}
// a^-1 b, by elimination with the largest pivot.
template <class P>
Matrix3<P> solved(Matrix3<P> a, Matrix3<P> b) {
  for (std::size_t k = 0; k < 3; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < 3; ++i)
      if (size_of(a[i][k]) > size_of(a[best][k])) best = i;
    const auto row = a[k], right = b[k];
    a[k] = a[best];
    b[k] = b[best];
    a[best] = row;
    b[best] = right;
    for (std::size_t i = 0; i < 3; ++i) {
      if (i == k) continue;
      const P factor = a[i][k] / a[k][k];
      for (std::size_t j = 0; j < 3; ++j) {
        a[i][j] = a[i][j] - factor * a[k][j];
        b[i][j] = b[i][j] - factor * b[k][j];
      }
    }
  }
  return filled<P>([&](std::size_t i, std::size_t j) { return b[i][j] / a[i][i]; });
}
}  // namespace detail

// The covariance before a measurement, P, that x' = A x + w, y = x_0 + v settles at, with the covariance Q of w and the
// variance R of v:
//   P = A (P - P c' (c P c' + R)^-1 c P) A' + Q,  c = (1 0 0).
// Each step of the structure-preserving doubling algorithm (Chu, Fan, Lin and Wang, 2004) does the work of all steps
// before it once more, so that filters a million ticks slow are solved as well.
template <class P>
Matrix3<P> steady_covariance(const Matrix3<P>& a, const Matrix3<P>& q, const P& r) {
  constexpr int kMostDoublings = 64;
  const Matrix3<P> one = detail::filled<P>([](std::size_t i, std::size_t j) { return P(i == j ? 1.0 : 0.0); });
  Matrix3<P> f = detail::transposed(a);
  Matrix3<P> g{};
  g[0][0] = P(1.0) / r;
  Matrix3<P> h = q;
  for (int k = 0; k < kMostDoublings; ++k) {
    const Matrix3<P> w = detail::sum(one, detail::product(g, h));
    const Matrix3<P> w_f = detail::solved(w, f);
    const Matrix3<P> w_g = detail::solved(w, g);
    const Matrix3<P> more = detail::product(detail::transposed(f), detail::product(h, w_f));
    g = detail::sum(g, detail::product(f, detail::product(w_g, detail::transposed(f))));
    f = detail::product(f, w_f);
    h = detail::sum(h, more);
    // Round-off must not make the sides of a symmetric matrix drift apart.
    const Matrix3<P> turned = detail::transposed(h);
    h = detail::filled<P>([&](std::size_t i, std::size_t j) { return P(0.5) * (h[i][j] + turned[i][j]); });
    if (!(detail::size_of(more[0][0]) > P(1e-17) * h[0][0] || detail::size_of(more[2][2]) > P(1e-17) * h[2][2])) break;
  }
  return h;
}

// What part of the measurement's surprise each state takes up: P c' / (c P c' + R).
template <class P>
std::array<P, 3> steady_gain(const Matrix3<P>& covariance, const P& r) {
  const P surprise = covariance[0][0] + r;
  return {covariance[0][0] / surprise, covariance[1][0] / surprise, covariance[2][0] / surprise};
}

}  // namespace flexspline::observers
