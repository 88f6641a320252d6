#include "host/input/data/record_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexspline::data {

double start_of_times(const Experiment& experiment) {
  // Up to there six digits show milliseconds.
  constexpr double kNearZero_s = 1000.0;
  if (experiment.time_s.empty() || std::abs(experiment.time_s.front()) < kNearZero_s) return 0.0;
  return experiment.time_s.front();
}

double start_of_times(const Dataset& dataset, std::string_view name) {
  const auto at = std::ranges::find(dataset.experiments, name, &Experiment::name);
  return at == dataset.experiments.end() ? 0.0 : start_of_times(*at);
}

std::string_view times_are(const Experiment& experiment) {
  return start_of_times(experiment) == 0.0 ? "" : kAfterFirstSample;
}

std::string time_text(const Experiment& experiment, double time_s) {
  return fmt::format("{:.6g} s{}", time_s - start_of_times(experiment), times_are(experiment));
}

std::string times_text(const Experiment& experiment, double from_s, double to_s) {
  const double start_s = start_of_times(experiment);
  return fmt::format("from {:.6g} s to {:.6g} s{}", from_s - start_s, to_s - start_s, times_are(experiment));
}

}  // namespace flexspline::data
