// What is in one experiment, before any model: for the command `check`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

struct SignalSummary {
  Column column = Column::current;
  std::string unit;
  double low = 0.0;
  double high = 0.0;
  // Standard deviation of what changes from sample to sample without a trend (median of third differences).
  double noise_std = 0.0;
  std::optional<double> quantum;           // smallest step, where all steps are multiples of one
  std::optional<double> stated_noise_std;  // by a key
};

struct RecordSummary {
  std::size_t samples = 0;
  double rate_hz = 0.0;
  double duration_s = 0.0;
  std::size_t gaps = 0;
  double masked_percent = 0.0;
  std::vector<SignalSummary> signals;
  // Of the motor, else of the output; none where neither is measured. Motion is above 1 % of the largest speed.
  std::optional<double> moving_percent;
  std::optional<double> lowest_speed;  // of what moves: a tenth of it is slower
  std::optional<double> highest_speed;
  std::optional<std::size_t> reversals;
  std::string speed_unit;
  std::optional<double> period_s;  // of a motion that repeats itself
};

RecordSummary summary_of(const Experiment& experiment, Axis axis);

// Speed of the motor, else of the output, smoothed over about ten samples; empty where no motion is measured.
std::vector<double> velocity_of(const Experiment& experiment);

}  // namespace flexspline::data
