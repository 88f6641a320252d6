// Quantiles of unordered numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace flexspline::numbers {

// The number at place floor(share (n - 1)) of the sorted ones, `share` from 0 to 1; zero of none.
inline double quantile(std::vector<double> x, double share) {
  if (x.empty()) return 0.0;
  const auto at = x.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(x.size() - 1));
  std::nth_element(x.begin(), at, x.end());
  return *at;
}

// The number at place floor(n / 2): of an even count the upper one of the middle pair. Zero of none.
inline double upper_median(std::vector<double> x) {
  if (x.empty()) return 0.0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace flexspline::numbers
