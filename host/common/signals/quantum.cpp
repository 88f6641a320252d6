#include "host/common/signals/quantum.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace flexspline::signals {
namespace {

// The last decimal that a signal was written with; zero where it has more than nine.
double last_decimal(std::span<const double> signal) {
  constexpr std::size_t kTested = 500;
  for (double unit = 1.0; unit > 0.5e-9; unit *= 0.1) {
    const auto is_whole = [&](double value) { return std::abs(value / unit - std::round(value / unit)) < 1e-4; };
    if (std::all_of(signal.begin(), signal.begin() + static_cast<std::ptrdiff_t>(std::min(kTested, signal.size())),
                    is_whole))
      return unit;
  }
  return 0.0;
}

// Least squares of the step size, from steps of a few times it first: a small error of it is large after many.
double refined(double quantum, const std::vector<double>& steps) {
  for (const double most : {2.0, 6.0, 20.0, 60.0}) {
    double products = 0.0, squares = 0.0;
    for (const double step : steps) {
      const double count = std::round(step / quantum);
      if (count < 1.0 || count > most) continue;
      products += count * step;
      squares += count * count;
    }
    if (squares > 0.0) quantum = products / squares;
  }
  return quantum;
}

}  // namespace

std::optional<double> quantum_of(std::span<const double> signal) {
  constexpr std::size_t kFewestSteps = 16;
  constexpr double kMostRounding = 0.1;
  std::vector<double> steps;
  for (std::size_t k = 1; k < signal.size(); ++k) {
    const double step = std::abs(signal[k] - signal[k - 1]);
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.size() < kFewestSteps) return std::nullopt;
  const auto low = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 100);
  std::nth_element(steps.begin(), low, steps.end());
  const double smallest = *low;
  // Each value is off by up to half of the last decimal, so a step by up to one of it.
  double rounding = last_decimal(signal) / smallest;
  if (rounding > kMostRounding) rounding = 0.0;
  const double quantum = rounding > 0.0 ? refined(smallest, steps) : smallest;
  const auto is_multiple = [&](double step) {
    const double count = step / quantum;
    return std::abs(count - std::round(count)) < 0.02 * std::max(1.0, 0.05 * count) + rounding;
  };
  const auto are_multiples = [&](const std::vector<double>& some) {
    const auto multiples = static_cast<std::size_t>(std::count_if(some.begin(), some.end(), is_multiple));
    return some.size() >= kFewestSteps && 10 * multiples >= 9 * some.size();
  };
  // Any number is near a multiple of what is far smaller: small multiples decide. And rounding of floating point has
  // steps of its own.
  constexpr double kSmallMultiple = 20.0, kFloatingPoint = 1e-12;
  std::vector<double> small;
  std::ranges::copy_if(steps, std::back_inserter(small), [&](double s) { return s <= kSmallMultiple * quantum; });
  double largest = 0.0;
  for (const double x : signal) largest = std::max(largest, std::abs(x));
  const bool is_one = quantum > kFloatingPoint * largest && are_multiples(steps) && are_multiples(small);
  return is_one ? std::optional(quantum) : std::nullopt;
}

}  // namespace flexspline::signals
