#include "host/engine/sensitivity/lines.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/common/signals/fft.hpp"

namespace flexspline::sensitivity {
namespace {

constexpr std::size_t kFewestSamples = 64;
constexpr std::size_t kMostLines = 4;
constexpr double kFewestPeriods = 2.0;
constexpr double kLeastShare = 0.1;  // of the largest amplitude; side lobes of the window are at 0.03

double hann(std::size_t k, std::size_t size) {
  return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(size));
}

// From -1 to 1 along the signal.
double along(std::size_t k, std::size_t size) {
  return (2.0 * static_cast<double>(k) + 1.0) / static_cast<double>(size) - 1.0;
}

std::vector<double> windowed(std::span<const double> signal) {
  double weights = 0.0, mean = 0.0, slope = 0.0, spread = 0.0;
  for (std::size_t k = 0; k < signal.size(); ++k) {
    const double w = hann(k, signal.size()), x = along(k, signal.size());
    weights += w;
    mean += w * signal[k];
    slope += w * x * signal[k];
    spread += w * x * x;
  }
  std::vector<double> result(signal.size());
  for (std::size_t k = 0; k < signal.size(); ++k)
    result[k] = hann(k, signal.size()) * (signal[k] - mean / weights - slope / spread * along(k, signal.size()));
  return result;
}

}  // namespace

std::vector<double> motion_lines(std::span<const double> signal, double sample_hz, double up_to_hz) {
  if (signal.size() < kFewestSamples) return {};
  const std::size_t size = signals::fast_fft_size(2 * signal.size());
  const auto spectrum = signals::RealFft(size).forward(windowed(signal));
  const double step_hz = sample_hz / static_cast<double>(size);
  const auto first = static_cast<std::size_t>(
      std::ceil(kFewestPeriods * sample_hz / static_cast<double>(signal.size()) / step_hz - 1e-9));
  const auto last = std::min(spectrum.size() - 1, static_cast<std::size_t>(up_to_hz / step_hz));
  double largest = 0.0;
  for (std::size_t k = first; k < last; ++k) largest = std::max(largest, std::abs(spectrum[k]));
  struct Peak {
    double frequency_hz, amplitude;
  };
  std::vector<Peak> peaks;
  for (std::size_t k = std::max<std::size_t>(1, first); k < last; ++k) {
    const double below = std::abs(spectrum[k - 1]), here = std::abs(spectrum[k]), above = std::abs(spectrum[k + 1]);
    if (!(here >= below && here > above && here >= kLeastShare * largest) || !(below > 0.0 && above > 0.0)) continue;
    // A parabola through the logarithms meets the peak of a Hann window.
    const double b = std::log(below), h = std::log(here), a = std::log(above);
    const double off = 2.0 * h - a - b > 0.0 ? 0.5 * (a - b) / (2.0 * h - a - b) : 0.0;
    peaks.push_back({(static_cast<double>(k) + off) * step_hz, here});
  }
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.amplitude > b.amplitude; });
  if (peaks.size() > kMostLines) peaks.resize(kMostLines);
  std::vector<double> lines;
  for (const Peak& peak : peaks) lines.push_back(peak.frequency_hz);
  return lines;
}

Sine sine_at(std::span<const double> signal, double sample_hz, double frequency_hz) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
  Eigen::Vector4d with_signal = Eigen::Vector4d::Zero();
  double squared = 0.0, weights = 0.0;
  const std::complex<double> turn = std::polar(1.0, 2.0 * std::numbers::pi * frequency_hz / sample_hz);
  std::complex<double> phasor = 1.0;
  for (std::size_t k = 0; k < signal.size(); ++k, phasor *= turn) {
    const double w = hann(k, signal.size());
    const Eigen::Vector4d basis(1.0, along(k, signal.size()), phasor.real(), phasor.imag());
    products.noalias() += w * basis * basis.transpose();
    with_signal += w * signal[k] * basis;
    squared += w * signal[k] * signal[k];
    weights += w;
  }
  const Eigen::Vector4d fit = products.ldlt().solve(with_signal);
  const std::complex<double> amplitude(fit[2], -fit[3]);
  if (!std::isfinite(std::abs(amplitude))) return {{kUnknown, kUnknown}, kUnknown};
  // A phasor of n turns drifts by some n rounding errors: nothing here.
  const double sine = 0.5 * std::norm(amplitude);
  const double rest = std::max(0.0, squared - fit.dot(with_signal)) / weights;
  return {amplitude, sine > 0.0 ? sine / (sine + rest) : 0.0};
}

}  // namespace flexspline::sensitivity
