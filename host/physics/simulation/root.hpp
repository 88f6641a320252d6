// Roots of increasing functions, with a bracket that cannot be lost.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexspline::simulation {

struct Root {
  double x = 0.0;
  double y = 0.0;  // the function where it was last evaluated
  // Slope of the last secant, or the one given: a good guess for the next root of a similar function.
  double slope = 1.0;
  bool converged = false;
  // Not converged, but the function jumps through zero between `low` and `high`, which are next to each other.
  bool jump = false;
  double low = 0.0;
  double high = 0.0;
};

// Finds x with abs(f(x)) <= tolerance for an f that increases, from a guess of the root and of the slope (positive).
// Secant steps, bisection where they leave the bracket or shrink it slowly; at most 120 evaluations. `low` and `high`
// are bounds that are known already.
template <class F>
Root find_root(F&& f, double guess, double slope, double tolerance,
               double low = -std::numeric_limits<double>::infinity(),
               double high = std::numeric_limits<double>::infinity()) {
  constexpr int kMaxEvaluations = 120;
  constexpr int kPatience = 6;  // steps on one side of the root before they are stretched
  Root root;
  root.x = guess;
  root.slope = slope;
  double previous_x = 0.0;
  double previous_y = 0.0;
  double width = std::numeric_limits<double>::infinity();
  int slow = 0;
  for (int n = 0; n < kMaxEvaluations; ++n) {
    root.y = f(root.x);
    if (std::abs(root.y) <= tolerance) {
      // A last correction costs nothing. Without it a good guess would be taken as it is, and what is left over would
      // have the same sign at every step.
      root.x -= root.y / root.slope;
      root.converged = true;
      return root;
    }
    if (!std::isfinite(root.y)) return root;
    (root.y < 0.0 ? low : high) = root.x;
    if (n > 0) {
      const double secant = (root.y - previous_y) / (root.x - previous_x);
      if (secant > 0.0 && std::isfinite(secant)) root.slope = secant;
    }
    previous_x = root.x;
    previous_y = root.y;
    double step = -root.y / root.slope;
    if (std::isfinite(low) && std::isfinite(high)) {
      slow = high - low > 0.5 * width ? slow + 1 : 0;
      width = high - low;
      if (width <= 4.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(low), std::abs(high)) ||
          n + 1 == kMaxEvaluations) {
        root.jump = true;
        root.low = low;
        root.high = high;
        return root;
      }
      double next = root.x + step;
      if (slow >= 3 || !(next > low && next < high)) {
        next = 0.5 * (low + high);
        slow = 0;
      }
      root.x = next;
    } else {
      if (n >= kPatience) step *= std::ldexp(1.0, 2 * (n - kPatience + 1));
      root.x += step;
    }
  }
  return root;
}

}  // namespace flexspline::simulation
