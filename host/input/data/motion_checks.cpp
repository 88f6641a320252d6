// Checks that compare the motion columns with each other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/input/data/checks.hpp"
#include "host/input/data/record_time.hpp"

namespace flexspline::data {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

bool near(double factor, double known) {
  return std::abs(factor / known - 1.0) < 0.02;
}

// The usual cause of a factor between velocity and the derivative of position; empty: unknown.
std::string cause_of(double factor, const DriveFacts& drive) {
  const double size = std::abs(factor);
  std::string sign = factor < 0.0 ? ", and its sign is turned round" : "";
  if (near(factor, -1.0)) return "its sign is turned round";
  if (near(size, 60.0 / kTurn_rad)) return "the velocity is in rpm" + sign;
  if (near(size, 360.0 / kTurn_rad)) return "the velocity is in deg/s" + sign;
  if (near(size, 1.0 / kTurn_rad)) return "the velocity is in turns per second" + sign;
  if (near(size, kTurn_rad)) return "the position is in turns" + sign;
  if (near(size, kTurn_rad / 360.0)) return "the position is in degrees" + sign;
  if (near(size, 360e3 / kTurn_rad)) return "the velocity is in mdeg/s" + sign;
  if (near(size, kTurn_rad / 360e3)) return "the position is in millidegrees" + sign;
  if (near(size, 1.0 / 6.0)) return "the velocity is in rpm and the position in degrees" + sign;
  if (near(size, 1000.0)) return "the velocity is in thousandths (mm/s, mrad/s), or the time in ms" + sign;
  if (near(size, 1e-3)) return "the position is in thousandths (mm, mrad)" + sign;
  if (drive.gear_ratio && *drive.gear_ratio > 1.05) {
    if (near(size, *drive.gear_ratio))
      return fmt::format("that is the gear ratio {}: the velocity is the motor's, the position the output's{}",
                         *drive.gear_ratio, sign);
    if (near(size, 1.0 / *drive.gear_ratio))
      return fmt::format("that is one over the gear ratio {}: the velocity is the output's, the position the motor's{}",
                         *drive.gear_ratio, sign);
  }
  if (near(size, 60.0))
    return "the velocity is in rpm and the position in turns" + sign +
           (drive.gear_ratio ? ""
                             : "; or the velocity is the motor's, the position the output's, with a gear ratio of 60");
  return "";
}

// Where none is stated, a factor as those of gears may be one.
std::string possible_gear(double factor, const DriveFacts& drive) {
  if (drive.gear_ratio || std::abs(factor) < 20.0 || std::abs(factor) > 1000.0) return "";
  return fmt::format(
      "; or the position is the output's and the velocity the motor's, with a gear ratio of about {:.4g}: state "
      "gear_ratio then",
      std::abs(factor));
}

// Beyond a factor of two no filter or delay explains it.
bool is_of_units(double factor) {
  return std::abs(factor) > 2.0 || std::abs(factor) < 0.5;
}

// Trapezoidal integral, from zero at the start of each segment.
std::vector<double> integral(const std::vector<double>& signal, const Experiment& experiment) {
  std::vector<double> sum(signal.size(), 0.0);
  for (const Segment& s : experiment.segments)
    for (std::size_t k = s.first + 1; k < s.last; ++k)
      sum[k] = sum[k - 1] + 0.5 * (signal[k] + signal[k - 1]) * experiment.sample_s;
  return sum;
}

void check_velocity(const Experiment& experiment, Column position, Column velocity, const DriveFacts& drive,
                    Findings& findings) {
  if (!experiment.has(position) || !experiment.has(velocity)) return;
  const IncrementRatio ratio =
      increment_ratio(integral(experiment[velocity], experiment), experiment[position], experiment.segments);
  if (!ratio.meaningful || (ratio.factor >= 0.95 && ratio.factor <= 1.05)) return;
  std::string cause = cause_of(ratio.factor, drive);
  const bool of_units = cause.empty() && is_of_units(ratio.factor);
  if (of_units)
    cause =
        "the unit of one of them, or its counts per turn, is likely another one" + possible_gear(ratio.factor, drive);
  findings.add(
      Severity::error, "velocity_position_mismatch", experiment.file.string(), 0, std::string(column_name(velocity)),
      fmt::format("in \"{}\" it is {:.4g} times the derivative of {}{}{}", experiment.name, ratio.factor,
                  column_name(position), cause.empty() ? "" : ": ", cause),
      fmt::format("give unit or scale of the wrong one under [columns.{}] or [columns.{}] in dataset.toml{}, or "
                  "leave one out{}",
                  column_name(velocity), column_name(position),
                  of_units ? " (unit = \"0.00153 rad\" where a turn is 4096 counts)" : "",
                  cause.empty() ? "; --tolerate velocity_position_mismatch uses it" : ""));
}

// One column that shows whether the drive moves.
std::optional<Column> motion_column(const Experiment& experiment) {
  for (const Column c :
       {Column::motor_position, Column::motor_velocity, Column::output_position, Column::output_velocity})
    if (experiment.has(c)) return c;
  return std::nullopt;
}

// At most the whole experiment, however short a sample claims to be.
std::size_t samples_in(double duration_s, const Experiment& experiment) {
  return static_cast<std::size_t>(std::min(duration_s / experiment.sample_s, static_cast<double>(experiment.size())));
}

struct Extent {
  double low = 0.0;
  double high = 0.0;
};

Extent extent_of(std::span<const double> signal, std::size_t first, std::size_t last) {
  const auto [low, high] = std::minmax_element(signal.begin() + static_cast<std::ptrdiff_t>(first),
                                               signal.begin() + static_cast<std::ptrdiff_t>(last));
  return {*low, *high};
}

// Excursion within an interval: the range of a position, the size of a velocity.
double excursion(std::span<const double> signal, bool is_position, std::size_t first, std::size_t last) {
  const Extent e = extent_of(signal, first, last);
  return is_position ? e.high - e.low : std::max(std::abs(e.low), std::abs(e.high));
}

}  // namespace

IncrementRatio increment_ratio(std::span<const double> y, std::span<const double> x,
                               std::span<const Segment> segments) {
  struct Sums {
    double xx = 0.0;
    double xy = 0.0;
    std::size_t count = 0;
  };
  std::size_t longest = 0;
  for (const Segment& s : segments) longest = std::max(longest, s.last - s.first);
  Sums best;
  for (std::size_t window = 1; window <= longest / 4; window *= 2) {
    Sums sums;
    const std::size_t stride = std::max<std::size_t>(1, window / 4);
    for (const Segment& s : segments)
      for (std::size_t k = s.first; k + window < s.last; k += stride) {
        const double dx = x[k + window] - x[k];
        sums.xx += dx * dx;
        sums.xy += dx * (y[k + window] - y[k]);
        ++sums.count;
      }
    if (sums.count >= 8 &&
        (best.count == 0 || sums.xx / static_cast<double>(sums.count) > best.xx / static_cast<double>(best.count)))
      best = sums;
  }
  if (best.count == 0 || best.xx <= 0.0) return {};
  const double rms = std::sqrt(best.xx / static_cast<double>(best.count));
  return {best.xy / best.xx, rms > 10.0 * noise_of(x, segments)};
}

double noise_of(std::span<const double> signal, std::span<const Segment> segments) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Segment& s : segments)
    for (std::size_t k = s.first + 1; k + 1 < s.last; ++k) {
      const double second = signal[k + 1] - 2.0 * signal[k] + signal[k - 1];
      sum += second * second;
      ++count;
    }
  return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count) / 6.0);
}

void check_velocities(const Experiment& experiment, const DriveFacts& drive, Findings& findings) {
  check_velocity(experiment, Column::motor_position, Column::motor_velocity, drive, findings);
  check_velocity(experiment, Column::output_position, Column::output_velocity, drive, findings);
}

void check_gear_ratio(const Experiment& experiment, const DriveFacts& drive, Findings& findings) {
  if (!drive.gear_ratio || experiment.load == Load::locked || !experiment.has(Column::motor_position) ||
      !experiment.has(Column::output_position))
    return;
  const IncrementRatio ratio =
      increment_ratio(experiment[Column::output_position], experiment[Column::motor_position], experiment.segments);
  const double factor = ratio.factor * *drive.gear_ratio;
  // Torsion and backlash take a share of small motions; only what a unit, a sign or another ratio explains is reported.
  if (!ratio.meaningful || (factor > 0.8 && factor < 1.25)) return;
  std::string cause;
  if (near(factor, -1.0)) cause = ": the sign of one of them is turned round";
  if (near(std::abs(factor), 360.0 / kTurn_rad)) cause = ": the output is in degrees";
  if (near(std::abs(factor), kTurn_rad / 360.0)) cause = ": the motor is in degrees";
  if (near(std::abs(factor), *drive.gear_ratio)) cause = ": both are on the same side of the gear";
  const std::string locked =
      std::abs(factor) < 0.8 && cause.empty() ? fmt::format("where the output is locked, {}; else ", kStateLocked) : "";
  findings.add(Severity::warning, "gear_ratio", experiment.file.string(), 0, "output_position_rad",
               fmt::format("in \"{}\" it moves {:.4g} times as far as motor_position_rad / gear_ratio ({}){}",
                           experiment.name, factor, *drive.gear_ratio, cause),
               locked + "check gear_ratio, and unit and scale of both columns in dataset.toml");
}

namespace {

struct Wrap {
  std::size_t sample;  // the last one before it
  double turns;        // of the jump: 1 or -1
};

// Where a position jumps by a turn, and by how much it moves there without that.
class WrapSearch {
 public:
  WrapSearch(const std::vector<double>& position, const std::vector<double>& time_s)
      : position_(position), time_s_(time_s) {}

  void find(const Segment& segment) {
    for (std::size_t k = segment.first + 1; k + 2 < segment.last; ++k) {
      const double step = step_at(k), before = step_at(k - 1), after = step_at(k + 1);
      // A longer step has another number of turns, which the neighbours' steps do not show.
      if (std::abs(before) >= std::numbers::pi || std::abs(after) >= std::numbers::pi) continue;
      // The step as the velocities on both sides have it; samples that were lost make it longer.
      const double duration = time_s_[k + 1] - time_s_[k];
      const double expected =
          0.5 * duration * (before / (time_s_[k] - time_s_[k - 1]) + after / (time_s_[k + 2] - time_s_[k + 1]));
      // Times that come in bursts make no velocities; slow motion is then seen by the steps alone.
      const bool slow = std::abs(before) < kClose_rad && std::abs(after) < kClose_rad;
      if (take(k, step, expected) || !slow) continue;
      take(k, step, 0.0);
    }
  }

  const std::vector<Wrap>& wraps() const { return wraps_; }
  double longest_step() const { return longest_step_; }

 private:
  static constexpr double kClose_rad = 0.5;

  double step_at(std::size_t k) const { return position_[k + 1] - position_[k]; }

  bool take(std::size_t k, double step, double expected) {
    const double turns = std::round((step - expected) / kTurn_rad);
    const double rest = step - turns * kTurn_rad;
    if (std::abs(turns) != 1.0 || std::abs(rest - expected) >= kClose_rad) return false;
    wraps_.push_back({k, turns});
    longest_step_ = std::max(longest_step_, std::abs(rest));
    return true;
  }

  const std::vector<double>& position_;
  const std::vector<double>& time_s_;
  std::vector<Wrap> wraps_;
  double longest_step_ = 0.0;
};

void add_turns(std::vector<double>& position, const std::vector<Wrap>& wraps) {
  double turns = 0.0;
  std::size_t next = 0;
  for (std::size_t k = 0; k < position.size(); ++k) {
    position[k] -= turns * kTurn_rad;
    if (next < wraps.size() && wraps[next].sample == k) turns += wraps[next++].turns;
  }
}

}  // namespace

void check_wrapped_positions(Experiment& experiment, Axis axis, Findings& findings) {
  if (axis != Axis::rotary) return;
  // Beyond half a turn between samples, motion in the other direction gives the same samples.
  constexpr double kNearlyAmbiguous_rad = 0.75 * std::numbers::pi;
  for (const Column column : {Column::motor_position, Column::output_position, Column::position_command}) {
    std::vector<double>& p = experiment[column];
    if (p.empty()) continue;
    WrapSearch search(p, experiment.time_s);
    for (const Segment& s : experiment.segments) search.find(s);
    const std::vector<Wrap>& wraps = search.wraps();
    if (wraps.empty()) continue;
    const std::string ambiguous =
        search.longest_step() > kNearlyAmbiguous_rad
            ? fmt::format(
                  "; it moves up to {:.3g} rad between two samples there, and beyond pi the number of turns "
                  "cannot be known",
                  search.longest_step())
            : "";
    const Severity severity =
        findings.add(Severity::error, "wrapped_position", experiment.file.string(), 0, std::string(column_name(column)),
                     fmt::format("in \"{}\" it jumps by a turn {} times, first at {}{}", experiment.name, wraps.size(),
                                 time_text(experiment, experiment.time_s[wraps.front().sample + 1]), ambiguous),
                     findings.tolerates("wrapped_position")
                         ? "the turns were added"
                         : "log the position without wrapping, or --tolerate wrapped_position to have the turns added");
    if (severity != Severity::error) add_turns(p, wraps);
  }
}

namespace {

// The smallest step of a position: an encoder at rest flickers by one.
double smallest_step(const std::vector<double>& x, const std::vector<Segment>& segments) {
  double resolution = 0.0;
  for (const Segment& s : segments)
    for (std::size_t k = s.first + 1; k < s.last; ++k) {
      const double step = std::abs(x[k] - x[k - 1]);
      if (step > 0.0 && (resolution == 0.0 || step < resolution)) resolution = step;
    }
  return resolution;
}

// Where a motion is looked for in a signal, and what counts as one.
struct RestSearch {
  const std::vector<double>& x;
  bool is_position;
  double noise;
  double largest;  // excursion in a block
  double still;
  std::size_t block;

  // A creeping motion is small in each block but not over the interval.
  bool creeps(std::size_t first, std::size_t end) const {
    if (is_position) return excursion(x, true, first, end) > 1.5 * still;
    double mean = 0.0;
    for (std::size_t i = first; i < end; ++i) mean += x[i] / static_cast<double>(end - first);
    return std::abs(mean) > std::max(4.0 * noise / std::sqrt(static_cast<double>(end - first)), 1e-3 * largest);
  }

  void find(const Segment& s, std::size_t shortest, std::vector<Segment>& intervals) const {
    for (std::size_t k = s.first; k < s.last;) {
      std::size_t end = k;
      while (end < s.last && excursion(x, is_position, end, std::min(end + block, s.last)) <= still)
        end = std::min(end + block, s.last);
      if (end - k >= shortest && !creeps(k, end)) intervals.push_back({k, end});
      k = end > k ? end : std::min(k + block, s.last);
    }
  }
};

void note_rest(const Experiment& experiment, Column column, double share, Findings& findings) {
  findings.add(Severity::note, "standstill", experiment.file.string(), 0, std::string(column_name(column)),
               fmt::format("\"{}\" is at rest for {:.0f} % of its samples; none is masked for that", experiment.name,
                           100.0 * share),
               "it identifies offsets alone; record motion as well");
}

void mask_rest(Experiment& experiment, Column column, const std::vector<Segment>& intervals, double share,
               Findings& findings) {
  const bool mask = experiment.load == Load::free;
  if (mask)
    for (const Segment& s : intervals)
      std::fill(experiment.masked.begin() + static_cast<std::ptrdiff_t>(s.first),
                experiment.masked.begin() + static_cast<std::ptrdiff_t>(s.last), std::uint8_t{1});
  findings.add(mask ? Severity::warning : Severity::note, "standstill", experiment.file.string(), 0,
               std::string(column_name(column)),
               fmt::format("\"{}\" is at rest for {:.0f} % of its samples, first {}{}", experiment.name, 100.0 * share,
                           times_text(experiment, experiment.time_s[intervals.front().first],
                                      experiment.time_s[intervals.front().last - 1]),
                           mask ? "; those samples are masked" : ""),
               "nothing needs doing if the rest moves enough");
}

}  // namespace

void check_standstill(Experiment& experiment, Findings& findings) {
  const std::optional<Column> column = motion_column(experiment);
  if (!column) return;
  const std::vector<double>& x = experiment[*column];
  const bool is_position = *column == Column::motor_position || *column == Column::output_position;
  const double noise = noise_of(x, experiment.segments);
  const double resolution = is_position ? smallest_step(x, experiment.segments) : 0.0;
  const std::size_t block = std::max<std::size_t>(10, samples_in(0.1, experiment));
  double largest = 0.0, whole = 0.0;
  for (const Segment& s : experiment.segments) {
    for (std::size_t k = s.first; k < s.last; k += block)
      largest = std::max(largest, excursion(x, is_position, k, std::min(k + block, s.last)));
    whole = std::max(whole, excursion(x, is_position, s.first, s.last));
  }
  const double floor = std::max(8.0 * noise, 2.0 * resolution);
  if (whole <= 2.0 * floor) {
    note_rest(experiment, *column, 1.0, findings);
    return;
  }
  const RestSearch search{x, is_position, noise, largest, std::max(floor, 0.005 * largest), block};
  const std::size_t shortest = std::max<std::size_t>(5 * block, samples_in(1.0, experiment));
  std::vector<Segment> intervals;
  std::size_t samples = 0, at_rest = 0;
  for (const Segment& s : experiment.segments) {
    samples += s.last - s.first;
    search.find(s, shortest, intervals);
  }
  if (intervals.empty()) return;
  for (const Segment& s : intervals) at_rest += s.last - s.first;
  const double share = static_cast<double>(at_rest) / static_cast<double>(samples);
  if (share > 0.95)
    note_rest(experiment, *column, share, findings);
  else
    mask_rest(experiment, *column, intervals, share, findings);
}

}  // namespace flexspline::data
