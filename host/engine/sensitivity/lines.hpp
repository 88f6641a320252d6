// Amplitude and phase of a model at the frequencies of a motion.
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace flexspline::sensitivity {

// Frequencies (Hz) at which a signal has power, the strongest first, at most four: peaks of its spectrum (Hann window,
// linear trend removed) with at least a tenth of the largest amplitude, of which the signal holds two periods or more,
// below `up_to_hz`. Empty where there is none, or the signal has less than 64 samples.
std::vector<double> motion_lines(std::span<const double> signal, double sample_hz, double up_to_hz);

// A sine in a signal.
struct Sine {
  std::complex<double> amplitude;  // the signal has Re(amplitude exp(j w t)), t from its first sample
  double share = 0.0;              // of the signal's variance, its linear trend removed
};

// Fits a sine and a linear trend by least squares with the weights of a Hann window, so that neither drift nor what
// dies out at the start counts for much. Not a number where the signal is not finite.
Sine sine_at(std::span<const double> signal, double sample_hz, double frequency_hz);

}  // namespace flexspline::sensitivity
