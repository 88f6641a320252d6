// The least of a function of one variable.
#pragma once

namespace flexspline::numbers {

// Golden-section search (Kiefer 1953): the middle of what is left of [low, high] after so many sections, each of which
// leaves 0.618 of it. `at` has one minimum there; it is called sections + 2 times.
template <class Function>
double golden_section(double low, double high, int sections, const Function& at) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = at(a), at_b = at(b);
  for (int k = 0; k < sections; ++k)
    if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = at(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = at(b);
    }
  return 0.5 * (low + high);
}

}  // namespace flexspline::numbers
