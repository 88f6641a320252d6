#pragma once

#include <span>
#include <vector>

namespace flexspline::signals {

/// The signal later by a number of samples that need not be whole: y[n] = x(n - delay), by the cubic through the four
/// samples around (Lagrange), so that cubics are shifted exactly and whole delays without any change. A negative
/// delay is an advance. What would come from beyond the ends is held at the end values. Near half a sample the gain
/// falls with frequency: 0.35 % at a tenth of the sample rate. Throws std::invalid_argument if the delay is not finite.
std::vector<double> fractional_delay(std::span<const double> signal, double delay_samples);

enum class Interpolation {
  kLinear,
  kMonotoneCubic,  ///< PCHIP (Fritsch and Carlson): smooth, never beyond the neighbouring values; linear below 4
                   ///< samples
};

/// Values at new times, from samples at increasing, possibly uneven times. Times outside are given the end value.
/// Interpolation across a gap invents data: cut there first. No anti-alias filter: filter before taking a lower rate.
/// Throws std::invalid_argument if the times do not increase strictly, or are not as many as the values, or there are
/// none.
std::vector<double> resample_uniform(std::span<const double> time_s, std::span<const double> values,
                                     std::span<const double> new_times_s,
                                     Interpolation interpolation = Interpolation::kMonotoneCubic);

}  // namespace flexspline::signals
