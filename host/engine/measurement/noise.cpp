#include "host/engine/measurement/noise.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/signals/spectrum.hpp"
#include "host/input/data/checks.hpp"

namespace flexspline::measurement {
namespace {

constexpr std::size_t kBandsADecade = 5;

double mean_square(std::span<const double> x) {
  double sum = 0.0;
  for (const double v : x) sum += v * v;
  return sum / static_cast<double>(x.size());
}

double rms_around_mean(std::span<const double> x) {
  double mean = 0.0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  double sum = 0.0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

// Of a signal without noise the arithmetic leaves something.
double beyond_rounding(double rms, const Channel& channel) {
  double largest = 0.0;
  for (const double v : channel.values) largest = std::max(largest, std::abs(v));
  return rms > 1e-12 * largest ? rms : 0.0;
}

// `density` at lines k * resolution_hz, the first of which is the mean.
std::vector<NoiseBand> bands_of(const std::vector<double>& density, double resolution_hz) {
  std::vector<NoiseBand> bands;
  const double step = std::pow(10.0, 1.0 / static_cast<double>(kBandsADecade));
  std::size_t k = 1;
  for (double edge = 1.5; k < density.size(); edge *= step) {
    double sum = 0.0;
    const std::size_t first = k;
    for (; k < density.size() && static_cast<double>(k) < edge; ++k) sum += density[k];
    if (k == first) continue;
    bands.push_back({(static_cast<double>(first) - 0.5) * resolution_hz, (static_cast<double>(k) - 0.5) * resolution_hz,
                     sum / static_cast<double>(k - first)});
  }
  return bands;
}

}  // namespace

NoiseLevel noise_by_periods(const Channel& channel, const Period& period, double sample_s) {
  NoiseLevel level{channel.name, channel.unit, 0.0, 0.0, "periods", {}};
  const Periods cut = periods_of(channel.values, period);
  const double resolution_hz = period.frequency_hz(1, sample_s);
  std::vector<double> density;
  double power = 0.0;
  const auto pairs = static_cast<double>(cut.values.size() - 1);
  for (std::size_t p = 1; p < cut.values.size(); ++p) {
    std::vector<double> d = cut.values[p];
    for (std::size_t k = 0; k < d.size(); ++k) d[k] -= cut.values[p - 1][k];
    remove_linear_trend(d);
    const auto n = static_cast<double>(d.size());
    // The difference holds the noise of both periods.
    const double share = 1.0 / ((cut.noise_gain[p] + cut.noise_gain[p - 1]) * pairs);
    power += share * mean_square(d) * n / (n - 2.0);
    const auto lines = line_amplitudes(d);
    density.resize(lines.size(), 0.0);
    for (std::size_t k = 0; k < lines.size(); ++k) density[k] += share * 0.5 * std::norm(lines[k]) / resolution_hz;
  }
  level.rms = beyond_rounding(std::sqrt(power), channel);
  const auto all =
      std::span(channel.values)
          .subspan(period.first, static_cast<std::size_t>(static_cast<double>(period.count) * period.exact_samples));
  level.signal_rms = rms_around_mean(all);
  level.bands = bands_of(density, resolution_hz);
  return level;
}

NoiseLevel noise_at_rest(const Channel& channel, std::span<const data::Segment> segments, double sample_s) {
  NoiseLevel level{channel.name, channel.unit, 0.0, 0.0, "standstill", {}};
  double squares = 0.0, freedoms = 0.0, samples = 0.0;
  std::size_t longest = 0;
  for (const data::Segment& s : segments) {
    if (s.last - s.first < 8) continue;
    std::vector<double> x(channel.values.begin() + static_cast<std::ptrdiff_t>(s.first + 1),
                          channel.values.begin() + static_cast<std::ptrdiff_t>(s.last));
    level.signal_rms += rms_around_mean(x) * rms_around_mean(x) * static_cast<double>(x.size());
    remove_linear_trend(x);
    squares += mean_square(x) * static_cast<double>(x.size());
    freedoms += static_cast<double>(x.size()) - 2.0;
    samples += static_cast<double>(x.size());
    const std::size_t window = x.size() / 8 * 2;
    if (window < 32 || x.size() <= longest) continue;
    longest = x.size();
    level.bands =
        bands_of(signals::power_density(x, 1.0 / sample_s, window), 1.0 / (sample_s * static_cast<double>(window)));
  }
  if (freedoms > 0.0) {
    level.rms = beyond_rounding(std::sqrt(squares / freedoms), channel);
    level.signal_rms = std::sqrt(level.signal_rms / samples);
  }
  return level;
}

bool is_at_rest(const data::Experiment& e) {
  using data::Column;
  bool seen = false;
  for (const Column column : {Column::current, Column::motor_torque, Column::motor_velocity, Column::motor_position,
                              Column::output_velocity, Column::output_position}) {
    if (!e.has(column)) continue;
    seen = seen || (column != Column::current && column != Column::motor_torque);
    const std::vector<double>& x = e[column];
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    // White noise of a million samples stays within five deviations on either side.
    if (*high - *low > 12.0 * data::noise_of(x, e.segments)) return false;
  }
  return seen;
}

}  // namespace flexspline::measurement
