#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace flexspline::signals {

/// Averaged spectra of a pair of signals (P. D. Welch, 1967): Hann windows of `segment` samples, half overlapping, each
/// without its mean. One-sided densities in unit^2/Hz at k sample_hz / segment, k = 0 .. segment/2; their sum times the
/// resolution is the variance of the signal.
struct CrossSpectrum {
  double sample_hz = 0.0;
  std::size_t segment = 0;
  std::size_t averages = 0;
  std::vector<double> frequency_hz;
  std::vector<double> xx, yy;
  /// conj(X) Y, so that xy / xx is the frequency response from x to y.
  std::vector<std::complex<double>> xy;

  /// Magnitude squared, 0..1; zero where either signal has no power, and one throughout for a single average.
  std::vector<double> coherence() const;
  /// Averages counted as independent ones: neighbouring Hann windows share 1/36 of their variance.
  double independent_averages() const;
};

/// Throws std::invalid_argument if the lengths differ, the segment is odd or below 8, or longer than the signals.
CrossSpectrum cross_spectrum(std::span<const double> x, std::span<const double> y, double sample_hz,
                             std::size_t segment);

/// Average over records of one sample rate and segment, each weighted by its averages. Throws std::invalid_argument if
/// there are none or they do not match.
CrossSpectrum pool(std::span<const CrossSpectrum> records);

/// Power spectral density of one signal, as `xx` above. Lines at k sample_hz / segment.
std::vector<double> power_density(std::span<const double> x, double sample_hz, std::size_t segment);

/// Magnitude squared coherence at k sample_hz / segment. See coherence_limit for what it must exceed to mean anything.
std::vector<double> coherence(std::span<const double> x, std::span<const double> y, double sample_hz,
                              std::size_t segment);

/// The coherence that unrelated signals exceed with this probability: 1 - p^(1/(K-1)); 1 where K <= 1.
double coherence_limit(double independent_averages, double probability = 0.05);

/// A signal that repeats itself.
struct Repetition {
  std::size_t samples;   ///< the period as a whole number of samples: use it for slicing
  double exact_samples;  ///< refined between samples; equal to `samples` if that is within 0.05
  double mismatch;       ///< RMS of signal(t + samples) - signal(t), over the RMS of the signal without its mean
};

/// The smallest period after which the signal repeats near perfectly; nothing if there is none, or if the data do not
/// hold two whole periods of it.
///
/// `mismatch_limit` bounds Repetition::mismatch, so a fast signal with a period between samples repeats only after some
/// of them. Of the lags that pass, a shorter one is preferred only if it matches about as well as the best (twice
/// its mismatch, or a tenth of the limit; both between samples): a small ripple at half the rate of the motion doubles
/// the period. The signal must have moved in between (mismatch above a half), so slow signals do not pass for periodic.
/// A turning axis repeats in velocity, not in position.
std::optional<Repetition> find_repetition(std::span<const double> signal, double mismatch_limit = 0.02);

/// Repetition::exact_samples in seconds.
std::optional<double> dominant_period_s(std::span<const double> signal, double sample_hz, double mismatch_limit = 0.02);

}  // namespace flexspline::signals
