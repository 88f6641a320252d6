#pragma once

#include <cstdint>
#include <vector>

#include "hil/plant/parameters.hpp"

namespace flexspline::plant {

/// A stream of random numbers that depends on its three keys only, so that switching one sensor on does not change the
/// noise of the others.
std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t record, std::uint64_t stream);

/// Standard deviation of a sensor's noise on a column with this peak.
double noise_std(const Sensor& sensor, const std::vector<double>& truth);

/// Adds noise with the sensor's correlation and standard deviation `std` to a column.
void add_noise(const Sensor& sensor, double std, std::uint64_t seed, std::vector<double>& column);

/// The column delayed by `delay_samples`, interpolated linearly; before the record it has its first value.
void delay(double delay_samples, std::vector<double>& column);

/// The column delayed by `delay_samples`, interpolated by cubics through value and rate (per sample).
void delay(double delay_samples, const std::vector<double>& rate_per_sample, std::vector<double>& column);

/// Angles rounded to counts per turn.
void quantise(int counts_per_turn, std::vector<double>& column);

}  // namespace flexspline::plant
