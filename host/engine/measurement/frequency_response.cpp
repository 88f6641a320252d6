#include "host/engine/measurement/frequency_response.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/signals/spectrum.hpp"

namespace flexspline::measurement {
namespace {

constexpr double kTrustedBand = 0.5;
constexpr double kTrustedCoherence = 0.5;
constexpr std::size_t kLowestLine = 4;
constexpr double kHighestShare = 0.4;  // of the sample rate
constexpr double kConfidence = 0.05;
// Coherence of signals without noise is one only up to rounding and interpolation.
constexpr double kLargestCoherence = 1.0 - 1e-12;

// The lowest lines hold what is slower than the window. Of a ramp the window leaves 1 / (k (k^2 - 1)) of the first
// line: 13 times the power of the side lobes below.
constexpr double kTrend = 16.0;

// Power that a Hann window leaks to a distance of d lines, over that of the line: below the envelope of its side lobes
// from the third line on, -31.5 dB at 2.4 lines and 18 dB an octave.
double leakage(double d) {
  const double r = 2.4 / d;
  return 7.1e-4 * r * r * r * r * r * r;
}

// Largest power that each line can owe to leakage from others.
std::vector<double> leaked(const std::vector<double>& power) {
  std::vector<double> leak(power.size(), 0.0);
  // Only lines that are above all within reach of theirs can leak more than there is: local maxima suffice.
  for (std::size_t j = 0; j < power.size(); ++j) {
    const double left = j > 0 ? power[j - 1] : 0.0, right = j + 1 < power.size() ? power[j + 1] : 0.0;
    if (!(power[j] > 0.0) || power[j] < left || power[j] < right) continue;
    for (std::size_t k = 0; k < power.size(); ++k) {
      const double d = std::abs(static_cast<double>(k) - static_cast<double>(j));
      if (d >= 3.0) leak[k] = std::max(leak[k], (j <= 2 ? kTrend : 1.0) * power[j] * leakage(d));
    }
  }
  return leak;
}

}  // namespace

void Spectra::add(const Spectra& other) {
  for (std::size_t k = 0; k < frequency_hz.size(); ++k) {
    xx[k] += other.xx[k];
    yy[k] += other.yy[k];
    xy[k] += other.xy[k];
    averages[k] += other.averages[k];
    distortion[k] += other.distortion[k];
  }
}

Spectra spectra_by_periods(const Channel& input, const Channel& output, const Period& period, double sample_s,
                           const ExcitedLines& excited) {
  const PeriodSpectra x(input.values, period), y(output.values, period);
  Spectra s;
  s.by_periods = true;
  s.resolution_hz = period.frequency_hz(1, sample_s);
  const std::size_t lines = x.lines();
  s.frequency_hz.resize(lines);
  s.xx.assign(lines, 0.0);
  s.yy.assign(lines, 0.0);
  s.xy.assign(lines, 0.0);
  s.averages.assign(lines, 0.0);
  s.distortion.assign(lines, 0.0);
  for (std::size_t k = 0; k < lines; ++k) s.frequency_hz[k] = period.frequency_hz(k, sample_s);
  // |c|^2 / 2 is the power of a line; over the resolution it is a density.
  const double scale = 0.5 / s.resolution_hz;
  // The last line is that at half the sample rate, where a difference and a hold have no defined phase.
  for (const std::size_t k : excited.lines) {
    if (k == 0 || k + 1 >= lines) continue;
    for (std::size_t p = 0; p < x.count(); ++p) {
      s.xx[k] += scale * std::norm(x[p][k]);
      s.yy[k] += scale * std::norm(y[p][k]);
      s.xy[k] += scale * std::conj(x[p][k]) * y[p][k];
    }
    s.averages[k] = static_cast<double>(x.count());
  }
  return s;
}

std::optional<Spectra> spectra_by_welch(const Channel& input, const Channel& output,
                                        std::span<const data::Segment> segments, double sample_s, std::size_t window,
                                        const WelchLimits& limits) {
  // Window by window, to see how many of them hold the power of a line: a chirp passes it once.
  std::vector<signals::CrossSpectrum> parts;
  double independent = 0.0;
  for (const data::Segment& segment : segments) {
    std::size_t windows = 0;
    for (std::size_t first = segment.first + 1; first + window <= segment.last; first += window / 2, ++windows)
      parts.push_back(signals::cross_spectrum(std::span(input.values).subspan(first, window),
                                              std::span(output.values).subspan(first, window), 1.0 / sample_s, window));
    signals::CrossSpectrum counted;
    counted.averages = windows;
    independent += counted.independent_averages();
  }
  if (parts.empty()) return std::nullopt;
  const signals::CrossSpectrum all = signals::pool(parts);

  Spectra s;
  s.resolution_hz = 1.0 / (sample_s * static_cast<double>(window));
  s.frequency_hz = all.frequency_hz;
  s.xx = all.xx;
  s.yy = all.yy;
  s.xy = all.xy;
  s.averages.assign(all.xx.size(), 0.0);
  s.distortion.assign(all.xx.size(), 0.0);
  const std::vector<double> leak_x = leaked(all.xx), leak_y = leaked(all.yy);
  for (std::size_t k = 0; k < all.xx.size(); ++k) {
    const bool near = limits.near_hz.empty() ||
                      std::any_of(limits.near_hz.begin(), limits.near_hz.end(),
                                  [&](double f) { return std::abs(f - s.frequency_hz[k]) < 2.0 * s.resolution_hz; });
    // What is slower than the window spreads over the lowest lines.
    const double highest = std::min(kHighestShare / sample_s, limits.to_hz.value_or(kHighestShare / sample_s));
    const bool inner = k >= kLowestLine && s.frequency_hz[k] <= highest;
    const bool excited = inner && near && all.xx[k] > 4.0 * leak_x[k] && all.yy[k] > 4.0 * leak_y[k];
    double squares = 0.0;
    for (const signals::CrossSpectrum& part : parts) squares += part.xx[k] * part.xx[k];
    const auto windows = static_cast<double>(parts.size());
    // Of noise the mean of the squares is twice the square of the mean.
    const double filled = squares > 0.0 ? std::min(1.0, 2.0 * all.xx[k] * all.xx[k] * windows / squares) : 1.0;
    const double weight = excited ? independent * filled : 0.0;
    s.xx[k] *= weight;
    s.yy[k] *= weight;
    s.xy[k] *= weight;
    s.averages[k] = weight;
  }
  return s;
}

std::vector<ResponseLine> response_of(const Spectra& s, const Channel& input, const Channel& output, double sample_s) {
  std::vector<ResponseLine> lines;
  for (std::size_t k = 0; k < s.frequency_hz.size(); ++k) {
    const double averages = s.averages[k], power = s.xx[k] * s.yy[k];
    if (averages < 1.5 || !(power > 0.0)) continue;
    ResponseLine line;
    line.frequency_hz = s.frequency_hz[k];
    line.response = s.xy[k] / s.xx[k] * output.correction(line.frequency_hz, sample_s) /
                    input.correction(line.frequency_hz, sample_s);
    line.coherence = std::min(kLargestCoherence, std::norm(s.xy[k]) / power);
    const double incoherent = (1.0 - line.coherence) / line.coherence;
    const double distortion = s.distortion[k] / s.yy[k];
    line.std = std::sqrt(0.5 * (incoherent / (averages - 1.0) + distortion));
    line.band = std::sqrt((std::pow(kConfidence, -1.0 / (averages - 1.0)) - 1.0) * incoherent -
                          std::log(kConfidence) * distortion);
    line.trusted = line.band < kTrustedBand && line.coherence > kTrustedCoherence;
    lines.push_back(line);
  }
  return lines;
}

std::vector<ResponseLine> thinned(std::span<const ResponseLine> lines, std::size_t most) {
  if (lines.size() <= most || most == 0) return {lines.begin(), lines.end()};
  const double low = lines.front().frequency_hz, span = std::log(lines.back().frequency_hz / low);
  std::vector<ResponseLine> chosen;
  std::size_t part = 0;
  for (const ResponseLine& line : lines) {
    const auto own = std::min(
        most - 1, static_cast<std::size_t>(static_cast<double>(most) * std::log(line.frequency_hz / low) / span));
    if (chosen.empty() || own > part)
      chosen.push_back(line);
    else if (line.band < chosen.back().band)
      chosen.back() = line;
    part = own;
  }
  return chosen;
}

}  // namespace flexspline::measurement
