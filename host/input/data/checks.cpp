#include "host/input/data/checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/input/data/record_time.hpp"
#include "host/input/data/units.hpp"

namespace flexspline::data {
namespace {

constexpr std::size_t kClippedRun = 10;  // samples in a row

struct Runs {
  std::vector<Segment> at_extremes;
  std::size_t extreme_samples = 0;
  std::size_t inner_samples = 0;  // in equally long runs outside of the limits
};

Runs runs_of(const std::vector<double>& signal, const Experiment& experiment) {
  Runs runs;
  const auto [low, high] = std::minmax_element(signal.begin(), signal.end());
  for (const Segment& s : experiment.segments)
    for (std::size_t k = s.first; k < s.last;) {
      std::size_t end = k + 1;
      while (end < s.last && signal[end] == signal[k]) ++end;
      if (end - k >= kClippedRun) {
        if (signal[k] == *low || signal[k] == *high) {
          runs.at_extremes.push_back({k, end});
          runs.extreme_samples += end - k;
        } else {
          runs.inner_samples += end - k;
        }
      }
      k = end;
    }
  return runs;
}

// 99th percentile of the size, from at most some ten thousand samples.
double usual_size(const std::vector<double>& signal) {
  const std::size_t stride = signal.size() / 20000 + 1;
  std::vector<double> sizes;
  for (std::size_t k = 0; k < signal.size(); k += stride) sizes.push_back(std::abs(signal[k]));
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>((sizes.size() - 1) * 99 / 100);
  std::nth_element(sizes.begin(), at, sizes.end());
  return *at;
}

constexpr double kMostAmperes = 200.0;

struct Range {
  Column column;
  double limit;  // in the column's unit; above it the unit cannot be right
  std::string_view likely;
};

// Well beyond any strain-wave drive: 28,000 rpm, 570 rpm at the output, the largest gears' 9 kN*m.
constexpr auto kRotary = std::to_array<Range>({
    {Column::current, kMostAmperes, "mA"},
    {Column::current_command, kMostAmperes, "mA"},
    {Column::motor_torque, 300.0, "mN*m"},
    {Column::motor_velocity, 3000.0, "rpm"},
    {Column::velocity_command, 3000.0, "rpm"},
    {Column::output_velocity, 60.0, "deg/s"},
    {Column::torque, 20000.0, "mN*m"},
    {Column::load_torque, 20000.0, "mN*m"},
});
constexpr auto kLinear = std::to_array<Range>({
    {Column::current, kMostAmperes, "mA"},
    {Column::current_command, kMostAmperes, "mA"},
    {Column::motor_position, 20.0, "mm"},
    {Column::output_position, 20.0, "mm"},
    {Column::position_command, 20.0, "mm"},
    {Column::motor_velocity, 20.0, "mm/s"},
    {Column::output_velocity, 20.0, "mm/s"},
    {Column::velocity_command, 20.0, "mm/s"},
    {Column::motor_torque, 1e6, "mN"},
    {Column::torque, 1e6, "mN"},
    {Column::load_torque, 1e6, "mN"},
});

// Whole numbers over more than `range`.
bool are_whole(const std::vector<double>& signal, double range) {
  const auto [low, high] = std::minmax_element(signal.begin(), signal.end());
  return *high - *low > range && std::all_of(signal.begin(), signal.end(), [](double v) { return v == std::round(v); });
}

void warn_of_unit(const Experiment& experiment, std::string_view column, const std::string& what,
                  std::string_view likely, Findings& findings, std::string_view or_else = "") {
  findings.add(Severity::warning, "unit", experiment.file.string(), 0, std::string(column),
               fmt::format("in \"{}\" {}: that is likely {}{}", experiment.name, what, likely, or_else),
               fmt::format("if so, write unit = \"{}\" under [columns.{}] in dataset.toml", likely, column));
}

}  // namespace

void check_clipping(Experiment& experiment, Findings& findings) {
  for (const Column column : {Column::current, Column::motor_torque, Column::torque}) {
    if (!experiment.has(column)) continue;
    // A command is held at a level on purpose.
    if (column != Column::torque && experiment.is_held_command()) continue;
    const std::vector<double>& signal = experiment[column];
    const Runs runs = runs_of(signal, experiment);
    // A signal that is made of levels, or coarsely resolved, has such runs everywhere.
    const bool levels = runs.inner_samples * 5 > runs.extreme_samples || runs.extreme_samples * 2 > signal.size();
    if (runs.at_extremes.empty() || levels) continue;
    for (const Segment& run : runs.at_extremes)
      std::fill(experiment.masked.begin() + static_cast<std::ptrdiff_t>(run.first),
                experiment.masked.begin() + static_cast<std::ptrdiff_t>(run.last), std::uint8_t{1});
    const Segment& first = runs.at_extremes.front();
    findings.add(Severity::warning, "clipping", experiment.file.string(), 0, std::string(column_name(column)),
                 fmt::format("in \"{}\" it is at exactly {:.6g} for {} samples from {} on, {} samples ({:.2g} %) in "
                             "{} such places; those samples are masked",
                             experiment.name, signal[first.first], first.last - first.first,
                             time_text(experiment, experiment.time_s[first.first]), runs.extreme_samples,
                             100.0 * static_cast<double>(runs.extreme_samples) / static_cast<double>(signal.size()),
                             runs.at_extremes.size()),
                 "raise the limit or the sensor's range, or move more gently");
  }
}

void check_whole_numbers(const Experiment& experiment, Findings& findings) {
  for (const Column column : {Column::motor_position, Column::output_position})
    if (experiment.has(column) && are_whole(experiment[column], 100.0))
      warn_of_unit(experiment, column_name(column), "it holds whole numbers only", "counts", findings,
                   " (or mdeg, where a turn is 360000)");
  for (const Column column : {Column::current, Column::motor_torque, Column::torque}) {
    if (!experiment.has(column) || !are_whole(experiment[column], 20.0)) continue;
    // Above that the range says mA.
    if (usual_size(experiment[column]) > kMostAmperes) continue;
    const std::string_view name = column_name(column);
    findings.add(
        Severity::warning, "unit", experiment.file.string(), 0, std::string(name),
        fmt::format("in \"{}\" it holds whole numbers only: that is likely per cent or per mille of the rated "
                    "value",
                    experiment.name),
        fmt::format("if so, write scale = RATED VALUE / 100 (or / 1000) under [columns.{}] in dataset.toml", name));
  }
}

void check_constant_columns(const Experiment& experiment, Findings& findings) {
  const auto is_constant = [&](Column column) {
    const std::vector<double>& signal = experiment[column];
    return !signal.empty() && std::all_of(signal.begin(), signal.end(), [&](double v) { return v == signal.front(); });
  };
  bool moves = false;
  for (const Column c :
       {Column::motor_position, Column::motor_velocity, Column::output_position, Column::output_velocity})
    moves = moves || (experiment.has(c) && !is_constant(c));
  for (std::size_t i = 0; i < kColumns; ++i) {
    const Column column = static_cast<Column>(i);
    if (!is_constant(column)) continue;
    const bool of_output = column == Column::output_position || column == Column::output_velocity;
    const bool of_motion = of_output || column == Column::motor_position || column == Column::motor_velocity;
    const bool may_be = column == Column::temperature || column >= Column::load_torque || (of_motion && !moves) ||
                        (of_output && experiment.load == Load::locked);
    findings.add(may_be ? Severity::note : Severity::warning, "constant_column", experiment.file.string(), 0,
                 std::string(column_name(column)),
                 fmt::format("in \"{}\" it is {:.6g} throughout", experiment.name, experiment[column].front()),
                 may_be ? "nothing needs doing if that is so"
                 : of_output
                     ? fmt::format("where the output is locked, {}; else check that the sensor is connected and "
                                   "logged",
                                   kStateLocked)
                     : "check that the sensor is connected and logged");
  }
}

void check_ranges(const Experiment& experiment, Axis axis, Findings& findings) {
  const std::span<const Range> ranges =
      axis == Axis::rotary ? std::span<const Range>(kRotary) : std::span<const Range>(kLinear);
  for (const Range& range : ranges) {
    if (!experiment.has(range.column)) continue;
    const double size = usual_size(experiment[range.column]);
    if (size > range.limit)
      warn_of_unit(experiment, column_name(range.column),
                   fmt::format("it reaches {:.4g} {}", size, unit_of(range.column, axis)), range.likely, findings);
  }
  if (experiment.has(Column::temperature)) {
    const double size = usual_size(experiment[Column::temperature]);
    if (size > 200.0)
      warn_of_unit(experiment, "temperature_c", fmt::format("it reaches {:.4g} degC", size),
                   size > 240.0 && size < 450.0 ? "K" : "degF", findings);
  }
  if (const auto unit = unit_of_time_step(experiment.sample_s))
    warn_of_unit(experiment, "time_s", fmt::format("a sample lasts {:.4g} s", experiment.sample_s), *unit, findings);
}

}  // namespace flexspline::data
