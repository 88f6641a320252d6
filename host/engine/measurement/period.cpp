#include "host/engine/measurement/period.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/common/signals/fft.hpp"
#include "host/common/signals/interpolate.hpp"
#include "host/common/signals/spectrum.hpp"

namespace flexspline::measurement {
namespace {

using data::Column;
using data::Experiment;

constexpr std::array kSetPoints = {Column::current_command, Column::velocity_command, Column::position_command};
constexpr std::array kMeasured = {Column::current, Column::motor_torque, Column::motor_velocity, Column::motor_position,
                                  Column::output_position};
// Mismatch of a period with the next, of the signal's RMS: of set points, which repeat exactly, and of what is noisy.
constexpr double kExact = 0.02, kNoisy = 0.15;
constexpr double kSetPointShare = 1e-3;
// Dry friction in closed loop puts a third harmonic of up to a third into the effort; lines above that are meant. Only
// among many of them weaker ones count as excited, too.
constexpr double kStrongShare = 0.35;
constexpr std::size_t kManyLines = 8;
constexpr double kEffortShare = 0.05;
constexpr double kEffortOverNoise = 10.0;
constexpr std::size_t kShortestPeriod = 16;
constexpr std::size_t kLargestFactor = 50;

data::Segment longest_segment(const Experiment& e) {
  data::Segment longest;
  for (const data::Segment& s : e.segments)
    if (s.last - s.first > longest.last - longest.first) longest = s;
  return longest;
}

bool is_constant(std::span<const double> x) {
  return std::all_of(x.begin(), x.end(), [&](double v) { return v == x.front(); });
}

struct Found {
  double exact_samples = 0.0;
  std::string from;
  double mismatch = 0.0;
};

std::optional<Found> search(const Experiment& e, const data::Segment& s) {
  const std::size_t n = s.last - s.first;
  const auto in = [&](Column column, double limit) {
    std::optional<Found> best;
    if (!e.has(column)) return best;
    // Excitations are often faded in.
    for (const std::size_t skip : {std::size_t{0}, n / 10, n / 4}) {
      const std::span<const double> part(e[column].data() + s.first + skip, n - skip);
      if (part.empty() || is_constant(part)) continue;
      const auto r = signals::find_repetition(part, limit);
      if (!r || r->samples < kShortestPeriod || (best && best->mismatch <= r->mismatch)) continue;
      best = Found{r->exact_samples, std::string(data::column_name(column)), r->mismatch};
    }
    return best;
  };
  for (const Column column : kSetPoints)
    if (auto found = in(column, kExact)) return found;
  // The signal with the least noise shows the period best.
  std::optional<Found> best;
  for (const Column column : kMeasured)
    if (auto found = in(column, kNoisy); found && (!best || found->mismatch < best->mismatch)) best = found;
  return best;
}

std::size_t largest_factor(std::size_t n) {
  std::size_t largest = 1;
  for (std::size_t f = 2; f * f <= n; ++f)
    for (; n % f == 0; n /= f) largest = f;
  return std::max(largest, n);
}

// sum_n x[n] exp(-2 pi j k n / N), k up to N/2, as a convolution of a size that is quick (L. I. Bluestein, 1970): kn is
// (k^2 + n^2 - (k - n)^2) / 2. A period may be of any length, and a large prime takes the plain transform minutes.
std::vector<std::complex<double>> transform_of_any_size(std::span<const double> x) {
  const std::size_t n = x.size(), lines = n / 2 + 1, size = signals::fast_fft_size(n + lines);
  const auto chirp = [n](std::size_t k) {
    // Whole turns are left out before they cost digits.
    const std::size_t turns = k * k % (2 * n);
    return std::polar(1.0, std::numbers::pi * static_cast<double>(turns) / static_cast<double>(n));
  };
  std::vector<double> ar(size, 0.0), ai(size, 0.0), br(size, 0.0), bi(size, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const std::complex<double> c = chirp(k), a = x[k] * std::conj(c);
    ar[k] = a.real();
    ai[k] = a.imag();
    if (k > 0) {
      br[size - k] = c.real();
      bi[size - k] = c.imag();
    }
    if (k < lines) {
      br[k] = c.real();
      bi[k] = c.imag();
    }
  }
  signals::RealFft fft(size);
  const auto far = fft.forward(ar), fai = fft.forward(ai), fbr = fft.forward(br), fbi = fft.forward(bi);
  std::vector<std::complex<double>> real(far.size()), imaginary(far.size());
  for (std::size_t k = 0; k < far.size(); ++k) {
    real[k] = far[k] * fbr[k] - fai[k] * fbi[k];
    imaginary[k] = far[k] * fbi[k] + fai[k] * fbr[k];
  }
  const std::vector<double> cr = fft.inverse(real), ci = fft.inverse(imaginary);
  std::vector<std::complex<double>> spectrum(lines);
  for (std::size_t k = 0; k < lines; ++k) spectrum[k] = std::complex(cr[k], ci[k]) * std::conj(chirp(k));
  return spectrum;
}

// How many of the periods, counted from the last one, remain after those in which the motion still settles: the first
// differs from the second by twice what the second differs from the third. At least three do.
std::size_t settled(const Experiment& e, const Period& period) {
  for (const Column column :
       {Column::motor_position, Column::motor_velocity, Column::output_position, Column::torque}) {
    if (!e.has(column)) continue;
    const Periods cut = periods_of(e[column], period);
    std::vector<double> change;
    for (std::size_t p = 1; p < cut.values.size(); ++p) {
      std::vector<double> d = cut.values[p];
      for (std::size_t k = 0; k < d.size(); ++k) d[k] -= cut.values[p - 1][k];
      remove_linear_trend(d);
      double sum = 0.0;
      for (const double v : d) sum += v * v;
      change.push_back(sum);
    }
    std::size_t first = 0;
    while (period.count - first > 3 && change[first] > 4.0 * change[first + 1]) ++first;
    return period.count - first;
  }
  return period.count;
}

}  // namespace

PeriodSearch find_period(const Experiment& e, std::optional<double> period_s) {
  const data::Segment s = longest_segment(e);
  if (s.last - s.first < 4 * kShortestPeriod) return {std::nullopt, "the record is too short to hold two periods"};
  std::optional<Found> found;
  if (period_s) {
    double exact = *period_s / e.sample_s;
    if (std::abs(exact - std::round(exact)) < 0.01) exact = std::round(exact);
    if (!(exact >= static_cast<double>(kShortestPeriod)))
      return {std::nullopt,
              fmt::format("the stated period of {:g} s holds fewer than {} samples", *period_s, kShortestPeriod)};
    found = Found{exact, "stated", 0.0};
  } else {
    found = search(e, s);
  }
  if (!found) return {std::nullopt, "neither set points, effort nor motion repeat themselves"};

  // Interpolation needs neighbours.
  const std::size_t margin = found->exact_samples == std::round(found->exact_samples) ? 0 : 2;
  const std::size_t begin = s.first + margin, end = s.last - margin;
  const double periods = std::floor(static_cast<double>(end - begin) / found->exact_samples);
  if (periods < 2.0)
    return {std::nullopt, fmt::format("the record holds {:.3g} periods of {:.4g} s; two whole ones are needed, six "
                                      "are good",
                                      static_cast<double>(s.last - s.first) / found->exact_samples,
                                      found->exact_samples * e.sample_s)};
  Period p;
  p.exact_samples = found->exact_samples;
  p.samples = static_cast<std::size_t>(std::lround(found->exact_samples));
  p.from = found->from;
  p.count = static_cast<std::size_t>(periods);
  // What is over at the end is better left out at the start, where the motion settles.
  const auto keep = [&](std::size_t count) {
    p.left_out += p.count - count;
    p.count = count;
    p.first = end - static_cast<std::size_t>(std::ceil(static_cast<double>(count) * found->exact_samples));
  };
  keep(p.count >= 3 ? p.count - 1 : p.count);
  keep(settled(e, p));
  return {p, ""};
}

void remove_linear_trend(std::vector<double>& x) {
  const auto n = static_cast<double>(x.size());
  const double middle = 0.5 * (n - 1.0);
  double mean = 0.0, slope = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mean += x[k] / n;
    slope += x[k] * (static_cast<double>(k) - middle);
  }
  slope *= 12.0 / (n * (n * n - 1.0));
  for (std::size_t k = 0; k < x.size(); ++k) x[k] -= mean + slope * (static_cast<double>(k) - middle);
}

Periods periods_of(std::span<const double> signal, const Period& period) {
  Periods periods;
  for (std::size_t p = 0; p < period.count; ++p) {
    const double start = static_cast<double>(period.first) + static_cast<double>(p) * period.exact_samples;
    const auto whole = static_cast<std::size_t>(start);
    const double fraction = start - static_cast<double>(whole);
    if (fraction == 0.0) {
      const auto part = signal.subspan(whole, period.samples);
      periods.values.emplace_back(part.begin(), part.end());
      periods.noise_gain.push_back(1.0);
      continue;
    }
    // One sample before and two behind, for the cubic.
    const std::size_t from = whole - 1, length = std::min(period.samples + 3, signal.size() - from);
    std::vector<double> shifted = signals::fractional_delay(signal.subspan(from, length), -fraction);
    shifted.resize(period.samples + 1, shifted.back());
    periods.values.emplace_back(shifted.begin() + 1, shifted.end());
    const std::array<double, 8> unit = {0, 0, 0, 0, 1, 0, 0, 0};
    double gain = 0.0;
    for (const double v : signals::fractional_delay(unit, -fraction)) gain += v * v;
    periods.noise_gain.push_back(gain);
  }
  return periods;
}

std::vector<std::complex<double>> line_amplitudes(std::span<const double> period) {
  const std::size_t n = period.size();
  std::vector<std::complex<double>> lines = n % 2 == 0 && largest_factor(n) <= kLargestFactor
                                                ? signals::RealFft(n).forward(period)
                                                : transform_of_any_size(period);
  const double scale = 2.0 / static_cast<double>(n);
  for (auto& line : lines) line *= scale;
  lines.front() *= 0.5;
  if (n % 2 == 0) lines.back() *= 0.5;
  return lines;
}

PeriodSpectra::PeriodSpectra(const Periods& periods) {
  for (const std::vector<double>& period : periods.values) spectra_.push_back(line_amplitudes(period));
}

std::complex<double> PeriodSpectra::mean(std::size_t line) const {
  std::complex<double> sum;
  for (const auto& spectrum : spectra_) sum += spectrum[line];
  return sum / static_cast<double>(spectra_.size());
}

double PeriodSpectra::noise_power(std::size_t line) const {
  if (spectra_.size() < 2) return 0.0;
  double sum = 0.0;
  for (std::size_t p = 1; p < spectra_.size(); ++p) sum += std::norm(spectra_[p][line] - spectra_[p - 1][line]);
  return 0.5 * sum / static_cast<double>(spectra_.size() - 1);
}

bool ExcitedLines::contains(std::size_t line) const {
  return std::binary_search(lines.begin(), lines.end(), line);
}

ExcitedLines excited_lines(const Experiment& e, const Period& period) {
  ExcitedLines excited;
  const auto take = [&](Column column, bool set_point) {
    const PeriodSpectra spectra(e[column], period);
    const auto periods = static_cast<double>(spectra.count());
    std::vector<double> sizes(spectra.lines(), 0.0);
    for (std::size_t k = 1; k < sizes.size(); ++k) {
      const double size = std::abs(spectra.mean(k));
      if (size > kEffortOverNoise * std::sqrt(spectra.noise_power(k) / periods)) sizes[k] = size;
    }
    const double largest = *std::max_element(sizes.begin(), sizes.end());
    if (!(largest > 0.0)) return false;
    const auto strong = static_cast<std::size_t>(
        std::count_if(sizes.begin(), sizes.end(), [&](double size) { return size > kStrongShare * largest; }));
    const double share = set_point ? kSetPointShare : strong >= kManyLines ? kEffortShare : kStrongShare;
    for (std::size_t k = 1; k < sizes.size(); ++k)
      if (sizes[k] > share * largest) excited.lines.push_back(k);
    excited.from = data::column_name(column);
    excited.by_set_point = set_point;
    return true;
  };
  for (const Column column : kSetPoints) {
    if (!e.has(column)) continue;
    const std::span<const double> part(e[column].data() + period.first, period.samples);
    if (!is_constant(part) && take(column, true)) return excited;
  }
  for (const Column column : {Column::current, Column::motor_torque})
    if (e.has(column) && take(column, false)) return excited;
  return excited;
}

}  // namespace flexspline::measurement
