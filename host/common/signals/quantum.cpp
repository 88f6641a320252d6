#include "host/common/signals/quantum.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexspline::signals {

std::optional<double> quantum_of(std::span<const double> signal) {
  constexpr std::size_t kFewestSteps = 16;
  std::vector<double> steps;
  for (std::size_t k = 1; k < signal.size(); ++k) {
    const double step = std::abs(signal[k] - signal[k - 1]);
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.size() < kFewestSteps) return std::nullopt;
  const auto low = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 100);
  std::nth_element(steps.begin(), low, steps.end());
  const double smallest = *low;
  const auto is_multiple = [&](double step) {
    const double count = step / smallest;
    return std::abs(count - std::round(count)) < 0.02 * std::max(1.0, 0.05 * count);
  };
  const auto multiples = static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), is_multiple));
  return 10 * multiples >= 9 * steps.size() ? std::optional(smallest) : std::nullopt;
}

}  // namespace flexspline::signals
