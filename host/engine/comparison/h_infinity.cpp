#include "host/engine/comparison/h_infinity.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "host/common/numbers/distributions.hpp"
#include "host/common/signals/spectrum.hpp"

namespace flexspline::comparison {
namespace {

constexpr std::size_t kShortest = 64;
constexpr std::size_t kWantedWindows = 4;
constexpr double kExcited = 1e-3;

}  // namespace

HInfinityNorm h_infinity_norm(const std::vector<double>& measured, const std::vector<double>& error,
                              const std::vector<data::Segment>& segments, double sample_hz, double up_to_hz) {
  HInfinityNorm norm;
  if (segments.empty()) return norm;
  const auto& longest = *std::max_element(segments.begin(), segments.end(), [](const auto& a, const auto& b) {
    return a.last - a.first < b.last - b.first;
  });
  const std::size_t n = longest.last - longest.first;
  if (n < kShortest) return norm;
  const std::size_t window = std::max<std::size_t>(kShortest / 2, n / kWantedWindows) & ~std::size_t{1};
  const auto part = [&](const std::vector<double>& x) { return std::span<const double>(x.data() + longest.first, n); };
  const signals::CrossSpectrum s = signals::cross_spectrum(part(measured), part(error), sample_hz, window);
  const std::vector<double> coherence = s.coherence();
  // The first line contains the rest of the mean.
  const double line_hz = sample_hz / static_cast<double>(window);
  const auto last = std::min(s.xx.size(), static_cast<std::size_t>(std::max(0.0, up_to_hz / line_hz)) + 1);
  double strongest = 0.0;
  for (std::size_t k = 1; k < last; ++k) strongest = std::max(strongest, s.xx[k]);
  if (!(strongest > 0.0)) return norm;
  std::vector<std::size_t> excited;
  for (std::size_t k = 1; k < last; ++k)
    if (s.xx[k] >= kExcited * strongest) excited.push_back(k);
  norm.windows = s.independent_averages();
  const double quantile = numbers::normal_quantile(1.0 - 0.025 / static_cast<double>(excited.size()));
  norm.value = 0.0;
  double low = 0.0, high = 0.0;
  for (const std::size_t k : excited) {
    const double ratio = std::sqrt(s.yy[k] / s.xx[k]);
    const double half = 0.5 * quantile * std::sqrt(2.0 * std::max(0.0, 1.0 - coherence[k]) / norm.windows);
    low = std::max(low, ratio * std::exp(-half));
    high = std::max(high, ratio * std::exp(half));
    if (ratio < norm.value) continue;
    norm.value = ratio;
    norm.frequency_hz = s.frequency_hz[k];
  }
  if (s.averages < 2) return norm;
  norm.low = low;
  norm.high = high;
  return norm;
}

}  // namespace flexspline::comparison
