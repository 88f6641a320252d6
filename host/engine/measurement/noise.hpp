// The noise of each signal: what differs from one period of the excitation to the next.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/engine/measurement/channels.hpp"
#include "host/engine/measurement/period.hpp"

namespace flexspline::measurement {

struct NoiseBand {
  double low_hz = 0.0;
  double high_hz = 0.0;
  double density = 0.0;  // mean, one-sided, unit^2/Hz
};

struct NoiseLevel {
  std::string signal;
  std::string unit;
  double rms = 0.0;         // of all frequencies above that of the period
  double signal_rms = 0.0;  // of the signal without its mean, for comparison
  std::string from;         // "periods", or "standstill" of a record at rest
  std::vector<NoiseBand> bands;
};

// Half the mean square of what differs between neighbouring periods, less a linear trend: a drift over periods is no
// noise. What repeats, ripple and a missing effect included, cancels.
NoiseLevel noise_by_periods(const Channel& channel, const Period& period, double sample_s);

// What varies while nothing moves, less a linear trend through each segment.
NoiseLevel noise_at_rest(const Channel& channel, std::span<const data::Segment> segments, double sample_s);

// No motion and no change of effort beyond what sampling noise makes.
bool is_at_rest(const data::Experiment& experiment);

}  // namespace flexspline::measurement
