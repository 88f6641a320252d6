// Checks of effort and velocity against the motion by physical laws.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "host/input/data/checks.hpp"

namespace flexspline::data {
namespace {

// Of the motor, by its own column or by differences of its position; empty where neither is there.
std::vector<double> motor_velocity_of(const Experiment& e) {
  if (e.has(Column::motor_velocity)) return e[Column::motor_velocity];
  if (!e.has(Column::motor_position)) return {};
  const std::vector<double>& p = e[Column::motor_position];
  std::vector<double> v(p.size(), 0.0);
  for (const Segment& s : e.segments)
    for (std::size_t k = s.first + 1; k + 1 < s.last; ++k) v[k] = (p[k + 1] - p[k - 1]) / (2.0 * e.sample_s);
  return v;
}

// From the first sample to the last at which the motor is back where it was then: between these the potential energy of
// load and springs is the same, and the kinetic energy almost.
Segment round_trip(const std::vector<double>& velocity, const Segment& s) {
  double at = 0.0, low = 0.0, high = 0.0;
  std::vector<double> travelled{0.0};
  for (std::size_t k = s.first + 1; k < s.last; ++k) {
    at += 0.5 * (velocity[k] + velocity[k - 1]);
    travelled.push_back(at);
    low = std::min(low, at);
    high = std::max(high, at);
  }
  // It must have moved away; a shaft that moves in one direction only never returns.
  std::size_t last = 0;
  bool was_away = false;
  for (std::size_t k = 1; k < travelled.size(); ++k) {
    was_away = was_away || std::abs(travelled[k]) > 0.4 * (high - low);
    if (was_away && std::abs(travelled[k]) < 0.02 * (high - low)) last = k;
  }
  return {s.first, s.first + last};
}

struct Fit {
  double slope = 0.0;
  double explained = 0.0;  // share of the variance
};

// Slope of `y` over `x`, with a constant and a drift in the fit; all of one length.
std::optional<Fit> slope_without_drift(std::vector<double> y, std::vector<double> x) {
  const std::size_t n = y.size();
  const auto without_drift = [&](std::vector<double>& values) {
    double mean = 0.0, cross = 0.0, square = 0.0;
    const double middle = 0.5 * static_cast<double>(n - 1);
    for (const double v : values) mean += v / static_cast<double>(n);
    for (std::size_t k = 0; k < n; ++k) {
      const double t = static_cast<double>(k) - middle;
      cross += t * (values[k] - mean);
      square += t * t;
    }
    for (std::size_t k = 0; k < n; ++k) values[k] -= mean + (static_cast<double>(k) - middle) * cross / square;
  };
  without_drift(y);
  without_drift(x);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    xx += x[k] * x[k];
    xy += x[k] * y[k];
    yy += y[k] * y[k];
  }
  if (!(xx > 0.0) || !(yy > 0.0) || !std::isfinite(xx * yy)) return std::nullopt;
  return Fit{xy / xx, xy * xy / (xx * yy)};
}

}  // namespace

void check_effort_sign(const Experiment& experiment, Findings& findings) {
  const Column effort = experiment.has(Column::current) ? Column::current : Column::motor_torque;
  const std::vector<double> velocity = motor_velocity_of(experiment);
  if (!experiment.has(effort) || velocity.empty()) return;
  double sum = 0.0, sizes = 0.0;
  for (const Segment& segment : experiment.segments) {
    const Segment trip = round_trip(velocity, segment);
    for (std::size_t k = trip.first; k < trip.last; ++k) {
      const double power = experiment[effort][k] * velocity[k];
      sum += power;
      sizes += std::abs(power);
    }
  }
  // Friction takes energy whichever way the drive moves; noise and offsets give a small share of either sign.
  constexpr double kShare = 0.2;
  if (!(sizes > 0.0) || !std::isfinite(sizes) || sum > -kShare * sizes) return;
  findings.add(
      Severity::warning, "sign", experiment.file.string(), 0, std::string(column_name(effort)),
      fmt::format("in \"{}\" the motor would take energy out of the drive wherever it moves ({:.0f} % of the power is "
                  "negative): the sign of {} or of the motor's motion is likely turned round",
                  experiment.name, 50.0 * (1.0 - sum / sizes), column_name(effort)),
      fmt::format("if so, write scale = -1 under [columns.{0}] in dataset.toml, or give flexspline new --turn {0}",
                  column_name(effort)));
}

void check_velocity_lag(const Experiment& experiment, Findings& findings) {
  constexpr auto kPairs = std::to_array<std::pair<Column, Column>>(
      {{Column::motor_position, Column::motor_velocity}, {Column::output_position, Column::output_velocity}});
  constexpr double kLeastSamples = 3.0, kLeast_s = 0.002, kExplained = 0.5;
  for (const auto& [position, velocity] : kPairs) {
    if (!experiment.has(position) || !experiment.has(velocity)) continue;
    const auto longest =
        std::max_element(experiment.segments.begin(), experiment.segments.end(),
                         [](const auto& a, const auto& b) { return a.last - a.first < b.last - b.first; });
    if (longest == experiment.segments.end() || longest->last - longest->first < 100) continue;
    // What a delayed velocity adds up to is behind the position by the velocity times the delay.
    std::vector<double> behind, v;
    double sum = 0.0;
    for (std::size_t k = longest->first; k < longest->last; ++k) {
      if (k > longest->first)
        sum += 0.5 * (experiment[velocity][k] + experiment[velocity][k - 1]) * experiment.sample_s;
      behind.push_back(experiment[position][k] - sum);
      v.push_back(experiment[velocity][k]);
    }
    const std::optional<Fit> fit = slope_without_drift(std::move(behind), std::move(v));
    if (!fit || fit->explained < kExplained ||
        std::abs(fit->slope) < std::max(kLeast_s, kLeastSamples * experiment.sample_s))
      continue;
    findings.add(
        Severity::warning, "velocity_lag", experiment.file.string(), 0, std::string(column_name(velocity)),
        fmt::format("in \"{}\" it is {} {} by {:.3g} s", experiment.name,
                    fit->slope > 0.0 ? "behind the derivative of" : "ahead of the derivative of", column_name(position),
                    std::abs(fit->slope)),
        "leave it out, so that the position is differentiated; or log it without the filter or with the same time");
  }
}

}  // namespace flexspline::data
