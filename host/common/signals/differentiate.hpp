#pragma once

#include <fmt/format.h>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <vector>

namespace flexspline::signals {

/// Derivative by central differences, in units of the signal per second; same length as the signal. The ends use the
/// one-sided formula of the same (second) order, so a parabola is differentiated exactly everywhere.
/// Two samples give their slope twice, one sample gives zero. Throws std::invalid_argument unless sample_s > 0.
/// `slope` takes the derivative, of the same length as the signal and not the same memory.
inline void central_derivative(std::span<const double> signal, double sample_s, std::span<double> slope) {
  if (!(sample_s > 0.0))
    throw std::invalid_argument(
        fmt::format("derivative: sample time {} s is not positive; check the time column", sample_s));
  const std::size_t n = signal.size();
  if (n == 1) slope[0] = 0.0;
  if (n == 2) slope[0] = slope[1] = (signal[1] - signal[0]) / sample_s;
  if (n < 3) return;
  const double scale = 0.5 / sample_s;
  for (std::size_t i = 1; i + 1 < n; ++i) slope[i] = (signal[i + 1] - signal[i - 1]) * scale;
  // Written in differences, so that a large offset costs no digits.
  slope[0] = (4.0 * (signal[1] - signal[0]) - (signal[2] - signal[0])) * scale;
  slope[n - 1] = (4.0 * (signal[n - 1] - signal[n - 2]) - (signal[n - 1] - signal[n - 3])) * scale;
}
inline std::vector<double> central_derivative(std::span<const double> signal, double sample_s) {
  std::vector<double> slope(signal.size(), 0.0);
  central_derivative(signal, sample_s, slope);
  return slope;
}

}  // namespace flexspline::signals
