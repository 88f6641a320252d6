// The report's integration methods.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace flexspline::report {

template <std::size_t n>
std::array<double, n> plus(std::array<double, n> y, double share, const std::array<double, n>& rate) {
  for (std::size_t k = 0; k < n; ++k) y[k] += share * rate[k];
  return y;
}

/// One classical fourth-order Runge-Kutta step of y' = rate(t, y): "a Runge-Kutta fixed-step integration method with
/// 1ms integration steps" (section 5.1).
template <std::size_t n, class Rate>
std::array<double, n> rk4_step(Rate&& rate, double t, const std::array<double, n>& y, double step_s) {
  const auto k1 = rate(t, y);
  const auto k2 = rate(t + 0.5 * step_s, plus(y, 0.5 * step_s, k1));
  const auto k3 = rate(t + 0.5 * step_s, plus(y, 0.5 * step_s, k2));
  const auto k4 = rate(t + step_s, plus(y, step_s, k3));
  return plus(plus(plus(plus(y, step_s / 6.0, k1), step_s / 3.0, k2), step_s / 3.0, k3), step_s / 6.0, k4);
}

struct StepLimits {
  double shortest_s = 1e-4;
  double longest_s = 1e-2;
  double tolerance = 1e-6;  ///< of every state, absolute
};

/// Integrates from `t` to `end_s` in steps of variable length, none shorter than `limits.shortest_s`, whatever the
/// error: "although the routine is using a variable integration step, since there is a lower bound on the integration
/// time the discontinuity generally occurs inside integration subintervals" (section 2.1.1). Bogacki and Shampine's
/// pair of orders 3 and 2. Calls `seen(t, y)` after each step.
template <std::size_t n, class Rate, class Seen>
std::array<double, n> variable_step(Rate&& rate, double t, std::array<double, n> y, double end_s,
                                    const StepLimits& limits, Seen&& seen) {
  double step = limits.longest_s;
  while (end_s - t > 1e-3 * limits.shortest_s) {
    step = std::min(step, end_s - t);
    const auto k1 = rate(t, y);
    const auto k2 = rate(t + 0.5 * step, plus(y, 0.5 * step, k1));
    const auto k3 = rate(t + 0.75 * step, plus(y, 0.75 * step, k2));
    const auto next = plus(plus(plus(y, step * 2.0 / 9.0, k1), step / 3.0, k2), step * 4.0 / 9.0, k3);
    const auto k4 = rate(t + step, next);
    double error = 0.0;
    for (std::size_t k = 0; k < n; ++k)
      error = std::max(error, step * std::abs(-5.0 / 72.0 * k1[k] + k2[k] / 12.0 + k3[k] / 9.0 - 0.125 * k4[k]));
    const bool shortest = step <= limits.shortest_s * (1.0 + 1e-9);
    if (error <= limits.tolerance || shortest) {
      t += step;
      y = next;
      seen(t, std::as_const(y));
    }
    const double growth = error > 0.0 ? 0.9 * std::cbrt(limits.tolerance / error) : 5.0;
    step = std::clamp(step * std::clamp(growth, 0.2, 5.0), limits.shortest_s, limits.longest_s);
  }
  return y;
}

}  // namespace flexspline::report
