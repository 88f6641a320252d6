#include "hil/plant/sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace flexspline::plant {
namespace {

// The finaliser of SplitMix64: neighbouring keys give unrelated seeds.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

template <class At>
void resample(double delay_samples, std::vector<double>& column, At at) {
  if (delay_samples <= 0.0 || column.empty()) return;
  std::vector<double> late(column.size());
  for (std::size_t k = 0; k < column.size(); ++k) {
    const double position = std::max(static_cast<double>(k) - delay_samples, 0.0);
    const auto left = std::min(static_cast<std::size_t>(position), column.size() - 1);
    late[k] = left + 1 < column.size() ? at(left, position - static_cast<double>(left)) : column[left];
  }
  column = std::move(late);
}

}  // namespace

std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t record, std::uint64_t stream) {
  return mix(mix(mix(seed) ^ record) ^ (stream << 32U));
}

double noise_std(const Sensor& sensor, const std::vector<double>& truth) {
  double peak = 0.0;
  for (const double value : truth) peak = std::max(peak, std::abs(value));
  return std::max(sensor.noise_share * peak, sensor.noise_floor);
}

void add_noise(const Sensor& sensor, double std, std::uint64_t seed, std::vector<double>& column) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const double fresh = std::sqrt(1.0 - sensor.correlation * sensor.correlation);
  double noise = normal(generator);
  for (double& value : column) {
    value += std * noise;
    noise = sensor.correlation * noise + fresh * normal(generator);
  }
}

void delay(double delay_samples, std::vector<double>& column) {
  resample(delay_samples, column, [&](std::size_t left, double fraction) {
    return column[left] + fraction * (column[left + 1] - column[left]);
  });
}

void delay(double delay_samples, const std::vector<double>& rate_per_sample, std::vector<double>& column) {
  resample(delay_samples, column, [&](std::size_t left, double x) {
    const double y0 = column[left], y1 = column[left + 1];
    const double m0 = rate_per_sample[left], m1 = rate_per_sample[left + 1];
    return y0 + x * (m0 + x * (3.0 * (y1 - y0) - 2.0 * m0 - m1 + x * (2.0 * (y0 - y1) + m0 + m1)));
  });
}

void quantise(int counts_per_turn, std::vector<double>& column) {
  const double count = 2.0 * std::numbers::pi / counts_per_turn;
  for (double& angle : column) angle = std::round(angle / count) * count;
}

}  // namespace flexspline::plant
