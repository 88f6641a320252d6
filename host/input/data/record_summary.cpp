#include "host/input/data/record_summary.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/common/numbers/quantile.hpp"
#include "host/input/data/period.hpp"

namespace flexspline::data {
namespace {

constexpr double kMovingShare = 0.01;    // of the largest speed
constexpr double kReversalShare = 0.05;  // a change of sign counts once it reaches this share of the largest speed

using numbers::quantile;

// Third differences of white noise have 1 + 9 + 9 + 1 = 20 times its variance; motion hardly changes them.
double noise_std(const std::vector<double>& x, const std::vector<Segment>& segments) {
  std::vector<double> thirds;
  for (const Segment& s : segments)
    for (std::size_t k = s.first + 3; k < s.last; ++k)
      thirds.push_back(std::abs(x[k] - 3.0 * x[k - 1] + 3.0 * x[k - 2] - x[k - 3]));
  if (thirds.empty()) return 0.0;
  const double median = quantile(thirds, 0.5);
  if (median > 0.0) return 1.4826 * median / std::sqrt(20.0);
  const double squares = std::inner_product(thirds.begin(), thirds.end(), thirds.begin(), 0.0);
  return std::sqrt(squares / static_cast<double>(thirds.size()) / 20.0);
}

SignalSummary signal_of(const Experiment& e, Column column, Axis axis) {
  const std::vector<double>& x = e[column];
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  SignalSummary s;
  s.column = column;
  s.unit = unit_of(column, axis);
  s.low = *low;
  s.high = *high;
  s.noise_std = noise_std(x, e.segments);
  s.quantum = step_of(e, column);
  s.stated_noise_std = e.noise_std[static_cast<std::size_t>(column)];
  return s;
}

std::size_t reversals_of(const std::vector<double>& velocity, double threshold) {
  std::size_t count = 0;
  int side = 0;
  for (const double v : velocity) {
    if (std::abs(v) < threshold) continue;
    const int now = v > 0.0 ? 1 : -1;
    if (side != 0 && now != side) ++count;
    side = now;
  }
  return count;
}

}  // namespace

std::vector<double> velocity_of(const Experiment& e) {
  for (const Column c : {Column::motor_velocity, Column::output_velocity})
    if (e.has(c) && !e.has(Column::motor_position)) return e[c];
  for (const Column c : {Column::motor_position, Column::output_position}) {
    if (!e.has(c)) continue;
    const std::vector<double>& p = e[c];
    std::vector<double> v(p.size(), 0.0);
    // Ten samples apart, the encoder's resolution does not pass for speed.
    constexpr std::size_t kReach = 5;
    for (const Segment& s : e.segments)
      for (std::size_t k = s.first; k < s.last; ++k) {
        const std::size_t from = std::max(s.first, k >= kReach ? k - kReach : 0);
        const std::size_t to = std::min(s.last - 1, k + kReach);
        if (to > from) v[k] = (p[to] - p[from]) / (static_cast<double>(to - from) * e.sample_s);
      }
    return v;
  }
  return {};
}

RecordSummary summary_of(const Experiment& e, Axis axis) {
  RecordSummary r;
  r.samples = e.size();
  r.rate_hz = e.sample_s > 0.0 ? 1.0 / e.sample_s : 0.0;
  r.duration_s = e.size() > 1 ? e.time_s.back() - e.time_s.front() : 0.0;
  r.gaps = e.segments.empty() ? 0 : e.segments.size() - 1;
  const auto masked = std::count_if(e.masked.begin(), e.masked.end(), [](std::uint8_t m) { return m != 0; });
  r.masked_percent = e.size() > 0 ? 100.0 * static_cast<double>(masked) / static_cast<double>(e.size()) : 0.0;
  for (std::size_t c = 0; c < kColumns; ++c)
    if (e.has(static_cast<Column>(c))) r.signals.push_back(signal_of(e, static_cast<Column>(c), axis));
  r.speed_unit = unit_of(Column::motor_velocity, axis);
  if (const auto period = period_samples(e)) r.period_s = *period * e.sample_s;

  const std::vector<double> velocity = velocity_of(e);
  if (velocity.empty()) return r;
  std::vector<double> speeds(velocity.size());
  std::transform(velocity.begin(), velocity.end(), speeds.begin(), [](double v) { return std::abs(v); });
  const double highest = quantile(speeds, 0.999);
  std::vector<double> moving;
  for (const double v : speeds)
    if (v > kMovingShare * highest) moving.push_back(v);
  r.moving_percent = 100.0 * static_cast<double>(moving.size()) / static_cast<double>(speeds.size());
  if (!moving.empty()) r.lowest_speed = quantile(moving, 0.1);
  r.highest_speed = highest;
  r.reversals = reversals_of(velocity, kReversalShare * highest);
  return r;
}

}  // namespace flexspline::data
