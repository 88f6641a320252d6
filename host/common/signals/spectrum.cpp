#include "host/common/signals/spectrum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "host/common/signals/fft.hpp"

namespace flexspline::signals {
namespace {

double mean_of(std::span<const double> x) {
  double sum = 0.0;
  for (const double v : x) sum += v;
  return sum / static_cast<double>(x.size());
}

class Windowed {
 public:
  explicit Windowed(std::size_t segment) : window_(segment), buffer_(segment), fft_(segment) {
    for (std::size_t i = 0; i < segment; ++i) {
      const double s = std::sin(std::numbers::pi * static_cast<double>(i) / static_cast<double>(segment));
      window_[i] = s * s;
      power_ += window_[i] * window_[i];
    }
  }
  std::vector<std::complex<double>> spectrum(std::span<const double> piece) {
    const double mean = mean_of(piece);
    for (std::size_t i = 0; i < piece.size(); ++i) buffer_[i] = (piece[i] - mean) * window_[i];
    return fft_.forward(buffer_);
  }
  double power() const { return power_; }

 private:
  std::vector<double> window_, buffer_;
  RealFft fft_;
  double power_ = 0.0;
};

}  // namespace

CrossSpectrum cross_spectrum(std::span<const double> x, std::span<const double> y, double sample_hz,
                             std::size_t segment) {
  if (x.size() != y.size())
    throw std::invalid_argument(
        fmt::format("spectrum: the signals have {} and {} samples; they must be of one length", x.size(), y.size()));
  if (!(sample_hz > 0.0)) throw std::invalid_argument(fmt::format("spectrum: sample rate {} Hz", sample_hz));
  if (segment < 8 || segment % 2 != 0 || segment > x.size())
    throw std::invalid_argument(fmt::format(
        "spectrum: segments of {} samples for a signal of {}; choose an even length from 8 to that of the signal",
        segment, x.size()));

  CrossSpectrum s;
  s.sample_hz = sample_hz;
  s.segment = segment;
  const std::size_t lines = segment / 2 + 1;
  s.frequency_hz.resize(lines);
  for (std::size_t k = 0; k < lines; ++k)
    s.frequency_hz[k] = sample_hz * static_cast<double>(k) / static_cast<double>(segment);
  s.xx.assign(lines, 0.0);
  s.yy.assign(lines, 0.0);
  s.xy.assign(lines, 0.0);

  Windowed windowed(segment);
  const bool same = x.data() == y.data();
  for (std::size_t start = 0; start + segment <= x.size(); start += segment / 2) {
    const auto fx = windowed.spectrum(x.subspan(start, segment));
    const auto fy = same ? fx : windowed.spectrum(y.subspan(start, segment));
    for (std::size_t k = 0; k < lines; ++k) {
      s.xx[k] += std::norm(fx[k]);
      s.yy[k] += std::norm(fy[k]);
      s.xy[k] += std::conj(fx[k]) * fy[k];
    }
    ++s.averages;
  }
  for (std::size_t k = 0; k < lines; ++k) {
    const double sides = k == 0 || k + 1 == lines ? 1.0 : 2.0;
    const double scale = sides / (sample_hz * windowed.power() * static_cast<double>(s.averages));
    s.xx[k] *= scale;
    s.yy[k] *= scale;
    s.xy[k] *= scale;
  }
  return s;
}

CrossSpectrum pool(std::span<const CrossSpectrum> records) {
  if (records.empty()) throw std::invalid_argument("spectrum: no records to pool");
  CrossSpectrum sum = records.front();
  const auto scale = [&sum](double factor) {
    for (auto& v : sum.xx) v *= factor;
    for (auto& v : sum.yy) v *= factor;
    for (auto& v : sum.xy) v *= factor;
  };
  scale(static_cast<double>(sum.averages));
  for (const CrossSpectrum& r : records.subspan(1)) {
    if (r.segment != sum.segment || std::abs(r.sample_hz - sum.sample_hz) > 1e-3 * sum.sample_hz)
      throw std::invalid_argument(
          fmt::format("spectrum: cannot pool segments of {} samples at {} Hz with {} at {} Hz; use one segment length",
                      r.segment, r.sample_hz, sum.segment, sum.sample_hz));
    const double weight = static_cast<double>(r.averages);
    for (std::size_t k = 0; k < sum.xx.size(); ++k) {
      sum.xx[k] += weight * r.xx[k];
      sum.yy[k] += weight * r.yy[k];
      sum.xy[k] += weight * r.xy[k];
    }
    sum.averages += r.averages;
  }
  scale(1.0 / static_cast<double>(sum.averages));
  return sum;
}

std::vector<double> CrossSpectrum::coherence() const {
  std::vector<double> c(xx.size(), 0.0);
  for (std::size_t k = 0; k < c.size(); ++k) {
    const double power = xx[k] * yy[k];
    if (power > 0.0) c[k] = std::min(1.0, std::norm(xy[k]) / power);
  }
  return c;
}

double CrossSpectrum::independent_averages() const {
  if (averages == 0) return 0.0;
  const double k = static_cast<double>(averages);
  return k / (1.0 + 2.0 / 36.0 * (1.0 - 1.0 / k));
}

std::vector<double> power_density(std::span<const double> x, double sample_hz, std::size_t segment) {
  return cross_spectrum(x, x, sample_hz, segment).xx;
}

std::vector<double> coherence(std::span<const double> x, std::span<const double> y, double sample_hz,
                              std::size_t segment) {
  return cross_spectrum(x, y, sample_hz, segment).coherence();
}

double coherence_limit(double independent_averages, double probability) {
  if (!(independent_averages > 1.0)) return 1.0;
  return 1.0 - std::pow(probability, 1.0 / (independent_averages - 1.0));
}

namespace {

// A lag at which the signal may repeat itself.
struct Candidate {
  std::size_t lag;
  double exact;
  double mismatch;  // between samples, where the valley's parabola has its lowest point
};

// Squared mismatch of all lags at once: energies of both parts less twice their product. `energy`: sums of squares.
std::vector<double> squared_mismatches(const std::vector<double>& x, const std::vector<double>& energy, double power,
                                       std::size_t longest) {
  const std::size_t n = x.size();
  const std::vector<double> product = lagged_products(x, longest + 1);
  std::vector<double> mismatch2(longest + 2);
  for (std::size_t lag = 0; lag < mismatch2.size(); ++lag) {
    const double pairs = static_cast<double>(n - lag);
    const double sum = energy[n - lag] + (energy[n] - energy[lag]) - 2.0 * product[lag];
    mismatch2[lag] = std::max(0.0, sum / (pairs * power));
  }
  return mismatch2;
}

// The lowest points of the valleys after the first rise.
std::vector<Candidate> valleys_of(const std::vector<double>& mismatch2, std::size_t longest, double mismatch_limit) {
  constexpr double kMoved2 = 0.5 * 0.5;
  std::vector<Candidate> candidates;
  std::size_t lag = 0;
  while (lag <= longest && mismatch2[lag] < kMoved2) ++lag;
  while (lag <= longest) {
    while (lag <= longest && mismatch2[lag] >= kMoved2) ++lag;
    if (lag > longest) break;
    std::size_t lowest = lag;
    for (; lag <= longest && mismatch2[lag] < kMoved2; ++lag)
      if (mismatch2[lag] < mismatch2[lowest]) lowest = lag;
    const double before = mismatch2[lowest - 1], here = mismatch2[lowest], after = mismatch2[lowest + 1];
    if (after < here) continue;  // still falling at the longest lag
    const double curvature = before - 2.0 * here + after;
    const double shift = curvature > 0.0 ? 0.5 * (before - after) / curvature : 0.0;
    const double floor2 = std::max(0.0, here - 0.25 * (before - after) * shift);
    if (std::sqrt(here) > mismatch_limit) continue;
    candidates.push_back({lowest, static_cast<double>(lowest) + shift, std::sqrt(floor2)});
  }
  return candidates;
}

}  // namespace

std::optional<Repetition> find_repetition(std::span<const double> signal, double mismatch_limit) {
  const std::size_t n = signal.size();
  if (n < 8) return std::nullopt;
  std::vector<double> x(signal.begin(), signal.end());
  const double mean = mean_of(signal);
  std::vector<double> energy(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] -= mean;
    energy[i + 1] = energy[i] + x[i] * x[i];
  }
  const double power = energy[n] / static_cast<double>(n);
  // A constant leaves rounding only; `!` also turns away values that are not finite.
  if (!(power > 1e-24 * mean * mean) || !std::isfinite(power)) return std::nullopt;
  const std::size_t longest = n / 2;
  const std::vector<Candidate> candidates =
      valleys_of(squared_mismatches(x, energy, power, longest), longest, mismatch_limit);

  double best = mismatch_limit;
  for (const Candidate& c : candidates) best = std::min(best, c.mismatch);
  const double accepted = std::min(mismatch_limit, std::max(2.0 * best, 0.1 * mismatch_limit));
  for (const Candidate& c : candidates) {
    if (c.mismatch > accepted) continue;
    double sum = 0.0;
    for (std::size_t i = 0; i + c.lag < n; ++i) sum += (x[i + c.lag] - x[i]) * (x[i + c.lag] - x[i]);
    const double whole = static_cast<double>(c.lag);
    return Repetition{c.lag, std::abs(c.exact - whole) < 0.05 ? whole : c.exact,
                      std::sqrt(sum / static_cast<double>(n - c.lag) / power)};
  }
  return std::nullopt;
}

std::optional<double> dominant_period_s(std::span<const double> signal, double sample_hz, double mismatch_limit) {
  const auto repetition = find_repetition(signal, mismatch_limit);
  if (!repetition) return std::nullopt;
  return repetition->exact_samples / sample_hz;
}

}  // namespace flexspline::signals
