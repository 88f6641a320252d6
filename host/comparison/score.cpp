#include "host/comparison/score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "host/signals/spectrum.hpp"

namespace flexspline::comparison {
namespace {

constexpr std::size_t kShortest = 64;
constexpr std::size_t kWantedWindows = 4;
constexpr double kExcited = 1e-3;

}  // namespace

void Score::add(double measured, double error) {
  Score one;
  one.samples_ = 1;
  one.mean_ = measured;
  one.error_mean_ = error;
  one.error_squared_ = error * error;
  one.largest_ = std::abs(error);
  add(one);
}

void Score::add(const Score& other) {
  if (other.samples_ == 0) return;
  const auto a = static_cast<double>(samples_), b = static_cast<double>(other.samples_), n = a + b;
  const double step = other.mean_ - mean_, error_step = other.error_mean_ - error_mean_;
  spread_ += other.spread_ + step * step * a * b / n;
  error_spread_ += other.error_spread_ + error_step * error_step * a * b / n;
  mean_ += step * b / n;
  error_mean_ += error_step * b / n;
  error_squared_ += other.error_squared_;
  largest_ = std::max(largest_, other.largest_);
  samples_ += other.samples_;
}

double Score::variance() const {
  const double v = samples_ > 0 ? spread_ / static_cast<double>(samples_) : 0.0;
  return v > 0.0 ? v : kUnknown;
}

double Score::rmse() const {
  return samples_ > 0 ? std::sqrt(error_squared_ / static_cast<double>(samples_)) : kUnknown;
}
double Score::nrmse() const {
  return rmse() / std::sqrt(variance());
}
double Score::fit_percent() const {
  return 100.0 * (1.0 - nrmse());
}
double Score::vaf_percent() const {
  return 100.0 * (1.0 - error_spread_ / static_cast<double>(std::max<std::size_t>(1, samples_)) / variance());
}
double Score::max_abs() const {
  return samples_ > 0 ? largest_ : kUnknown;
}

double worst_case_gain(const std::vector<double>& measured, const std::vector<double>& error,
                       const std::vector<data::Segment>& segments, double sample_hz, double up_to_hz) {
  if (segments.empty()) return kUnknown;
  const auto& longest = *std::max_element(segments.begin(), segments.end(), [](const auto& a, const auto& b) {
    return a.last - a.first < b.last - b.first;
  });
  const std::size_t n = longest.last - longest.first;
  if (n < kShortest) return kUnknown;
  const std::size_t window = std::max<std::size_t>(kShortest / 2, n / kWantedWindows) & ~std::size_t{1};
  const auto part = [&](const std::vector<double>& x) { return std::span<const double>(x.data() + longest.first, n); };
  const std::vector<double> signal = signals::power_density(part(measured), sample_hz, window);
  const std::vector<double> wrong = signals::power_density(part(error), sample_hz, window);
  const double line_hz = sample_hz / static_cast<double>(window);
  // The first line contains the rest of the mean.
  const auto last = std::min(signal.size(), static_cast<std::size_t>(std::max(0.0, up_to_hz / line_hz)) + 1);
  double strongest = 0.0, largest = 0.0;
  for (std::size_t k = 1; k < last; ++k) strongest = std::max(strongest, signal[k]);
  if (!(strongest > 0.0)) return kUnknown;
  for (std::size_t k = 1; k < last; ++k)
    if (signal[k] >= kExcited * strongest) largest = std::max(largest, wrong[k] / signal[k]);
  return std::sqrt(largest);
}

}  // namespace flexspline::comparison
