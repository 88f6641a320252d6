#include "host/input/data/time_base.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/signals/interpolate.hpp"

namespace flexspline::data {
namespace {

enum class Method : std::uint8_t { hold, linear, cubic };

Method method_of(Column column, bool held_command) {
  switch (column) {
    case Column::motor_position:
    case Column::motor_velocity:
    case Column::output_position:
    case Column::output_velocity:
      return Method::cubic;
    case Column::velocity_command:
    case Column::position_command:
    case Column::current_command:
      return Method::hold;
    case Column::current:
    case Column::motor_torque:
      return held_command ? Method::hold : Method::linear;
    default:
      return Method::linear;
  }
}

// The last value before or at each new time; a step that falls on a sample, but for rounding, is there already.
std::vector<double> held(std::span<const double> time_s, std::span<const double> values,
                         std::span<const double> new_times_s, double sample_s) {
  std::vector<double> result;
  result.reserve(new_times_s.size());
  std::size_t at = 0;
  for (const double t : new_times_s) {
    while (at + 1 < time_s.size() && time_s[at + 1] <= t + 1e-6 * sample_s) ++at;
    result.push_back(values[at]);
  }
  return result;
}

}  // namespace

TimeBase time_base(std::span<const double> time_s) {
  TimeBase base;
  const std::size_t steps = time_s.size() - 1;
  const auto step = [&](std::size_t i) { return time_s[i + 1] - time_s[i]; };
  // Long recordings need much memory, so one array is used twice.
  std::vector<double> sorted(steps);
  for (std::size_t i = 0; i < steps; ++i) sorted[i] = step(i);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(steps / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double median = *middle;

  double duration = 0.0;
  double samples = 0.0;
  for (std::size_t i = 0; i < steps; ++i)
    if (const double s = step(i); s <= kGapSamples * median) {
      duration += s;
      samples += std::max(1.0, std::round(s / median));
    }
  base.sample_s = duration / samples;

  std::vector<double>& deviation = sorted;
  deviation.clear();
  Segment segment{0, 0};
  for (std::size_t i = 0; i < steps; ++i) {
    const double in_samples = step(i) / base.sample_s;
    if (in_samples > kGapSamples) {
      segment.last = i + 1;
      base.segments.push_back(segment);
      segment.first = i + 1;
      if (step(i) > base.longest_gap_s) {
        base.longest_gap_s = step(i);
        base.longest_gap_at_s = time_s[i];
      }
      continue;
    }
    const double whole = std::max(1.0, std::round(in_samples));
    base.lost_samples += static_cast<std::size_t>(whole) - 1;
    deviation.push_back(std::abs(in_samples - whole));
  }
  segment.last = time_s.size();
  base.segments.push_back(segment);

  if (!deviation.empty()) {
    base.jitter_max = *std::max_element(deviation.begin(), deviation.end());
    const auto p99 = deviation.begin() + static_cast<std::ptrdiff_t>((deviation.size() - 1) * 99 / 100);
    std::nth_element(deviation.begin(), p99, deviation.end());
    base.jitter = *p99;
  }
  return base;
}

void resample(Experiment& experiment, const TimeBase& base) {
  const std::vector<double> old_time = std::move(experiment.time_s);
  const std::vector<std::uint8_t> old_mask = std::move(experiment.masked);
  const auto old_columns = std::move(experiment.columns);
  experiment.time_s.clear();
  experiment.masked.clear();
  experiment.columns = {};
  experiment.segments.clear();

  for (const Segment& from : base.segments) {
    const std::size_t count = from.last - from.first;
    const std::span<const double> old(old_time.data() + from.first, count);
    const std::size_t grid = static_cast<std::size_t>((old.back() - old.front()) / base.sample_s + 1e-6) + 1;
    const Segment to{experiment.time_s.size(), experiment.time_s.size() + grid};
    for (std::size_t k = 0, at = 0; k < grid; ++k) {
      const double t = old.front() + static_cast<double>(k) * base.sample_s;
      while (at + 2 < count && old[at + 1] <= t) ++at;
      experiment.time_s.push_back(t);
      experiment.masked.push_back(old_mask[from.first + at] | old_mask[from.first + std::min(at + 1, count - 1)]);
    }
    const std::span<const double> times(experiment.time_s.data() + to.first, grid);
    for (std::size_t c = 0; c < kColumns; ++c) {
      if (old_columns[c].empty()) continue;
      const std::span<const double> values(old_columns[c].data() + from.first, count);
      const Method method = method_of(static_cast<Column>(c), experiment.is_held_command());
      const std::vector<double> resampled =
          method == Method::hold
              ? held(old, values, times, base.sample_s)
              : signals::resample_uniform(old, values, times,
                                          method == Method::linear ? signals::Interpolation::kLinear
                                                                   : signals::Interpolation::kMonotoneCubic);
      experiment.columns[c].insert(experiment.columns[c].end(), resampled.begin(), resampled.end());
    }
    experiment.segments.push_back(to);
  }
  experiment.sample_s = base.sample_s;
}

}  // namespace flexspline::data
