#include "host/common/signals/cutoff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "host/common/signals/spectrum.hpp"

namespace flexspline::signals {
namespace {

constexpr double kPowerShare = 0.999;
constexpr double kGapRatio = 3.2;
constexpr double kMargin = 1.25;
constexpr double kBandsPerOctave = 6.0;
constexpr double kClearShare = 0.2;
constexpr double kFinestResolutionHz = 0.5;
constexpr std::size_t kWantedSegments = 8;
constexpr std::size_t kShortestSegment = 64;

struct Band {
  double high_hz;
  double power;  // coherent, 0 if the band does not count
};

// The longest power of two that leaves eight segments, but no finer than needed.
std::size_t segment_length(std::size_t samples, double sample_hz) {
  std::size_t segment = kShortestSegment;
  while (2 * segment * kWantedSegments <= samples && sample_hz / static_cast<double>(segment) > kFinestResolutionHz)
    segment *= 2;
  return segment;
}

// The line at zero is without meaning, as each segment loses its mean.
std::vector<Band> coherent_bands(const CrossSpectrum& s) {
  const double averages = s.independent_averages();
  const double limit = coherence_limit(averages);
  const std::vector<double> coherence = s.coherence();
  const double resolution = s.frequency_hz[1];
  std::vector<Band> bands;
  for (std::size_t first = 1; first < coherence.size();) {
    const double high = s.frequency_hz[first] * std::exp2(1.0 / kBandsPerOctave);
    double power = 0.0, coherent = 0.0;
    std::size_t k = first;
    for (; k < coherence.size() && (k == first || s.frequency_hz[k] < high); ++k) {
      power += s.yy[k];
      coherent += coherence[k] * s.yy[k];
    }
    const double band_coherence = power > 0.0 ? coherent / power : 0.0;
    // Unrelated signals show a coherence of 1/K on average.
    const double unbiased = (band_coherence - 1.0 / averages) / (1.0 - 1.0 / averages);
    bands.push_back(
        {s.frequency_hz[k - 1], band_coherence > limit ? std::max(0.0, unbiased) * power * resolution : 0.0});
    first = k;
  }
  return bands;
}

double two_digits(double value) {
  const double step = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::round(value / step) * step;
}

// The bands up to the first wide gap.
struct CoherentPower {
  double total = 0.0;
  std::size_t end = 0;
};

CoherentPower coherent_power_of(const std::vector<Band>& bands) {
  CoherentPower sum;
  double last_hz = 0.0;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    if (!(bands[b].power > 0.0)) continue;
    if (last_hz > 0.0 && bands[b].high_hz > kGapRatio * last_hz) break;
    sum.total += bands[b].power;
    last_hz = bands[b].high_hz;
    sum.end = b + 1;
  }
  return sum;
}

void require_one_length(std::size_t effort, std::size_t motion, double sample_hz) {
  if (!(sample_hz > 0.0))
    throw std::invalid_argument(fmt::format("cut-off: sample rate {} Hz; check the time column", sample_hz));
  if (effort != motion)
    throw std::invalid_argument(
        fmt::format("cut-off: {} samples of effort but {} of motion; they must be of one length", effort, motion));
}

}  // namespace

CutoffChoice choose_cutoff(std::span<const double> effort, std::span<const double> motion_velocity_or_acceleration,
                           double sample_hz) {
  require_one_length(effort.size(), motion_velocity_or_acceleration.size(), sample_hz);
  const double highest = sample_hz / 10.0;
  const double lowest = std::min(kLowestCutoffHz, highest);
  CutoffChoice choice;
  if (effort.size() < kShortestSegment * kWantedSegments / 2) {
    choice.cutoff_hz = highest;
    choice.reason = fmt::format("{:.3g} Hz, a tenth of the sample rate: {} samples are too few for a coherence",
                                highest, effort.size());
    return choice;
  }

  const std::size_t segment = segment_length(effort.size(), sample_hz);
  const CrossSpectrum spectrum = cross_spectrum(motion_velocity_or_acceleration, effort, sample_hz, segment);
  const std::vector<Band> bands = coherent_bands(spectrum);

  const auto [total, end] = coherent_power_of(bands);
  if (!(total > 0.0)) {
    choice.cutoff_hz = lowest;
    choice.reason = fmt::format(
        "{:.3g} Hz, the lowest allowed: effort and motion are not coherent at any frequency ({} segments of {} "
        "samples)",
        lowest, spectrum.averages, segment);
    return choice;
  }
  double below = 0.0;
  for (std::size_t b = 0; b < end && below < kPowerShare * total; ++b) {
    below += bands[b].power;
    if (bands[b].power > 0.0) choice.coherent_to_hz = bands[b].high_hz;
  }
  choice.coherent_power = total;
  const double wanted = kMargin * choice.coherent_to_hz;
  choice.cutoff_hz = two_digits(wanted);
  std::string bound;
  if (wanted > highest) {
    choice.cutoff_hz = highest;
    bound = ", lowered to a tenth of the sample rate";
  } else if (wanted < lowest) {
    choice.cutoff_hz = lowest;
    bound = ", raised to the lowest allowed";
  }
  choice.reason = fmt::format(
      "{:.3g} Hz: {:.2f} % of the effort that is coherent with the motion is below {:.3g} Hz, a quarter was added{} "
      "({} segments of {} samples)",
      choice.cutoff_hz, 100.0 * below / total, choice.coherent_to_hz, bound, spectrum.averages, segment);
  return choice;
}

double reversals_hz(std::span<const double> position, double sample_s, double window_s) {
  if (!(sample_s > 0.0) || !(window_s >= sample_s))
    throw std::invalid_argument(fmt::format("reversals: a window of {} s, sampled each {} s", window_s, sample_s));
  const auto window = static_cast<std::size_t>(std::lround(window_s / sample_s));
  if (position.size() <= 8 * window) return 0.0;
  const std::size_t n = position.size() - window;
  const auto travel = [&](std::size_t k) { return position[k + window] - position[k]; };
  double squares = 0.0;
  for (std::size_t k = 0; k < n; ++k) squares += travel(k) * travel(k);
  const double clear = kClearShare * std::sqrt(squares / static_cast<double>(n));
  std::size_t reversals = 0;
  double way = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double moved = travel(k);
    if (!(std::abs(moved) > clear)) continue;
    if (moved * way < 0.0) ++reversals;
    way = moved;
  }
  return static_cast<double>(reversals) / (static_cast<double>(n) * sample_s);
}

CutoffChoice combine_cutoffs(std::span<const CutoffChoice> records, CutoffCombination combination) {
  if (records.empty()) throw std::invalid_argument("cut-off: no records to combine");
  std::vector<CutoffChoice> sorted;
  for (const CutoffChoice& r : records)
    if (r.coherent_power > 0.0) sorted.push_back(r);
  const std::size_t coherent_records = sorted.size();
  if (sorted.empty()) sorted.assign(records.begin(), records.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.cutoff_hz < b.cutoff_hz; });

  double total = 0.0, strongest = 0.0;
  for (const CutoffChoice& r : sorted) {
    total += r.coherent_power;
    strongest = std::max(strongest, r.coherent_power);
  }
  CutoffChoice chosen;
  if (combination == CutoffCombination::kLargest) {
    for (const CutoffChoice& r : sorted)
      if (r.coherent_power >= 0.01 * strongest) chosen = r;
  } else {
    double below = 0.0;
    for (const CutoffChoice& r : sorted) {
      chosen = r;
      below += r.coherent_power;
      if (below >= 0.5 * total) break;
    }
  }
  chosen.coherent_power = total;
  if (records.size() > 1)
    chosen.reason =
        fmt::format("{} ({} of {} records, {} of them with coherence)", chosen.reason,
                    combination == CutoffCombination::kLargest ? "the largest" : "the median by coherent power",
                    records.size(), coherent_records);
  return chosen;
}

}  // namespace flexspline::signals
