// The period of an excitation that repeats itself, and the record cut into its periods.
#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::measurement {

struct Period {
  double exact_samples = 0.0;
  std::size_t samples = 0;   // of one period, rounded
  std::size_t first = 0;     // sample of the record at which the first period that counts begins
  std::size_t count = 0;     // whole periods from there, at least two
  std::size_t left_out = 0;  // periods before `first`, in which the motion settles
  std::string from;          // column that it was found in; "stated" where the user gave it

  // A whole number of samples: only then do lines fall where the Fourier transform of a period has them.
  bool is_whole() const { return exact_samples == static_cast<double>(samples); }
  double frequency_hz(std::size_t line, double sample_s) const {
    return static_cast<double>(line) / (exact_samples * sample_s);
  }
};

struct PeriodSearch {
  std::optional<Period> period;
  std::string why_not;  // a sentence without a full stop; empty where there is one
};

// Uses the longest segment: set points first, as they repeat exactly, then effort and motion, of which the one that
// repeats best is taken. The first period is left out
// where at least three are there, and more while the motion still settles and three remain. With `period_s` nothing is
// searched for.
PeriodSearch find_period(const data::Experiment& experiment, std::optional<double> period_s = std::nullopt);

// Removes the linear trend (least squares), and with it two degrees of freedom.
void remove_linear_trend(std::vector<double>& signal);

// The periods of a signal, one after the other. A period between samples is cut by cubic interpolation.
struct Periods {
  std::vector<std::vector<double>> values;
  // By which interpolation multiplies the variance of white noise; one where the period is whole.
  std::vector<double> noise_gain;
};
Periods periods_of(std::span<const double> signal, const Period& period);

// Complex amplitudes of one period: signal = mean + sum_k |c[k]| cos(2 pi k n / samples + arg c[k]), k up to half.
std::vector<std::complex<double>> line_amplitudes(std::span<const double> period);

// Line amplitudes of all periods.
class PeriodSpectra {
 public:
  PeriodSpectra() = default;
  explicit PeriodSpectra(const Periods& periods);
  PeriodSpectra(std::span<const double> signal, const Period& period) : PeriodSpectra(periods_of(signal, period)) {}

  std::size_t lines() const { return spectra_.empty() ? 0 : spectra_.front().size(); }
  std::size_t count() const { return spectra_.size(); }
  const std::vector<std::complex<double>>& operator[](std::size_t period) const { return spectra_[period]; }
  std::complex<double> mean(std::size_t line) const;
  // E|noise|^2 of one period's amplitude: half the mean square of the differences of neighbouring periods, so that
  // warming up is no noise. The mean of all has 1 / count of it.
  double noise_power(std::size_t line) const;

 private:
  std::vector<std::vector<std::complex<double>>> spectra_;
};

// Lines that the excitation holds, ten times above the noise: those of a set point above a thousandth of its largest;
// without a set point those of the effort above a third of its largest, as weaker ones may be a controller's answer to
// friction, or above a twentieth where at least eight are above the third. Sorted, without the mean.
struct ExcitedLines {
  std::vector<std::size_t> lines;
  std::string from;  // column
  bool by_set_point = false;

  bool contains(std::size_t line) const;
};
ExcitedLines excited_lines(const data::Experiment& experiment, const Period& period);

}  // namespace flexspline::measurement
