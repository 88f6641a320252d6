#include "host/engine/measurement/distortion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/common/numbers/distributions.hpp"

namespace flexspline::measurement {
namespace {

constexpr double kSignificant = 1e-3;
// Below that rounding of numbers in files is seen.
constexpr double kLowestDb = -100.0;
constexpr std::size_t kHarmonics = 20;
constexpr std::size_t kFewestLines = 3;

double decibel(double power_ratio) {
  return power_ratio > 0.0 ? 10.0 * std::log10(power_ratio) : -std::numeric_limits<double>::infinity();
}

class Lines {
 public:
  Lines(const Channel& input, const Channel& output, const Period& period, double sample_s, const ExcitedLines& excited)
      : output_(output),
        period_(period),
        sample_s_(sample_s),
        excited_(excited),
        x_(input.values, period),
        y_(output.values, period) {
    for (const std::size_t k : excited.lines) {
      response_.push_back(y_.mean(k) / x_.mean(k));
      excited_power_ += std::norm(y_.mean(k)) * physical(k) / static_cast<double>(excited.lines.size());
    }
  }

  std::size_t count() const { return y_.lines(); }

  // Sums of power where `per_line` is false, by which harmonics of a sine are found.
  DistortionLevel level(const std::vector<std::size_t>& detection, bool corrected, bool per_line) const {
    const auto periods = static_cast<double>(y_.count());
    double power = 0.0, noise = 0.0, squares = 0.0;
    for (const std::size_t k : detection) {
      const std::complex<double> g = corrected ? response_at(k) : 0.0;
      const auto of = [&](std::size_t p) { return y_[p][k] - g * x_[p][k]; };
      power += std::norm(y_.mean(k) - g * x_.mean(k)) * physical(k);
      double differences = 0.0;
      for (std::size_t p = 1; p < y_.count(); ++p) differences += std::norm(of(p) - of(p - 1));
      const double own = (0.5 * differences / ((periods - 1.0) * periods) + steps(k)) * physical(k);
      noise += own;
      squares += own * own;
    }
    const auto lines = static_cast<double>(detection.size());
    const double over = per_line ? lines : 1.0;
    DistortionLevel level;
    level.lines = detection.size();
    const double distortion = std::max(0.0, power - noise);
    level.level_db = decibel(distortion / over / excited_power_);
    level.noise_db = decibel(noise / over / excited_power_);
    level.rms = std::sqrt(0.5 * distortion);
    if (noise > 0.0) {
      // Noise is larger where the response is: lines count as far as they hold it (F. E. Satterthwaite, 1946).
      // Differences of neighbours share a period: two thirds of them count as independent.
      const double of_power = 2.0 * noise * noise / squares;
      const double of_noise = of_power * (periods - 1.0) * (periods > 2.0 ? 2.0 / 3.0 : 1.0);
      level.p_value = numbers::fisher_f_above(of_power, of_noise, power / noise);
    } else if (power > 0.0) {
      level.p_value = 0.0;
    }
    level.significant = level.p_value < kSignificant && level.level_db > kLowestDb;
    return level;
  }

 private:
  double physical(std::size_t line) const {
    return std::norm(output_.correction(period_.frequency_hz(line, sample_s_), sample_s_));
  }

  // Power of a line that the encoder's steps make, as white noise that repeats itself.
  double steps(std::size_t line) const {
    const auto samples = static_cast<double>(period_.samples);
    double power = 4.0 * output_.step_variance / samples;
    if (output_.differenced) {
      const double slope = 2.0 * std::sin(std::numbers::pi * static_cast<double>(line) / samples) / sample_s_;
      power *= slope * slope;
    }
    return power;
  }

  std::complex<double> response_at(std::size_t line) const {
    const auto& lines = excited_.lines;
    const auto above = static_cast<std::size_t>(std::lower_bound(lines.begin(), lines.end(), line) - lines.begin());
    if (above == 0) return response_.front();
    if (above == lines.size()) return response_.back();
    const double share =
        static_cast<double>(line - lines[above - 1]) / static_cast<double>(lines[above] - lines[above - 1]);
    return response_[above - 1] + share * (response_[above] - response_[above - 1]);
  }

  const Channel& output_;
  const Period& period_;
  double sample_s_;
  const ExcitedLines& excited_;
  PeriodSpectra x_, y_;
  std::vector<std::complex<double>> response_;
  double excited_power_ = 0.0;  // mean of a line
};

}  // namespace

Distortion distortion_of(const Channel& input, const Channel& output, const Period& period, double sample_s,
                         const ExcitedLines& excited) {
  Distortion d;
  d.input = input.name;
  d.output = output.name;
  d.unit = output.unit;
  d.excited_lines = excited.lines.size();
  const auto neither = [&](std::string why) {
    d.odd_why_not = d.even_why_not = std::move(why);
    return d;
  };
  if (excited.lines.empty()) return neither("no line of the period is above the noise of the effort");
  d.low_hz = period.frequency_hz(excited.lines.front(), sample_s);
  d.high_hz = period.frequency_hz(excited.lines.back(), sample_s);
  if (!period.is_whole()) return neither("the period is no whole number of samples, so that its lines smear");

  const Lines lines(input, output, period, sample_s, excited);
  if (excited.lines.size() == 1) {
    d.excitation = Excitation::kSine;
    const std::size_t base = excited.lines.front();
    std::vector<std::size_t> odd, even;
    for (std::size_t h = 2; h <= kHarmonics && h * base + 1 < lines.count(); ++h)
      (h % 2 == 1 ? odd : even).push_back(h * base);
    if (odd.empty()) return neither("the sample rate leaves no room for its harmonics");
    d.odd = lines.level(odd, false, false);
    d.even = lines.level(even, false, false);
    return d;
  }

  if (std::any_of(excited.lines.begin(), excited.lines.end(), [](std::size_t k) { return k % 2 == 0; }))
    return neither("even lines of the period are excited, too, and hide what a nonlinearity adds to them");
  d.excitation = Excitation::kOddMultisine;
  std::vector<std::size_t> odd, even;
  for (std::size_t k = excited.lines.front(); k < excited.lines.back(); ++k)
    if (k % 2 == 0)
      even.push_back(k);
    else if (!excited.contains(k))
      odd.push_back(k);
  const auto evaluate = [&](const std::vector<std::size_t>& detection, const char* why,
                            std::optional<DistortionLevel>& to, std::string& why_not) {
    if (detection.size() < kFewestLines)
      why_not = why;
    else
      to = lines.level(detection, true, true);
  };
  evaluate(odd, "hardly an odd line within the band is left out", d.odd, d.odd_why_not);
  evaluate(even, "the band holds hardly an even line", d.even, d.even_why_not);
  return d;
}

}  // namespace flexspline::measurement
