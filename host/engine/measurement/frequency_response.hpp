// The frequency response from effort to motion, torque and torsion, with what can be trusted of it.
#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/engine/measurement/channels.hpp"
#include "host/engine/measurement/period.hpp"

namespace flexspline::measurement {

// Averaged spectra of input and output, line by line; records of one kind may be added up.
struct Spectra {
  std::vector<double> frequency_hz;
  std::vector<double> xx, yy;  // sums over the averages, scaled as densities
  std::vector<std::complex<double>> xy;
  std::vector<double> averages;  // independent ones of each line
  // Of the output's power, what nonlinear distortion adds as far as it is known; it repeats itself, so that coherence
  // over periods does not see it.
  std::vector<double> distortion;
  double resolution_hz = 0.0;
  bool by_periods = false;

  void add(const Spectra& other);  // of the same lines
};

// Whole periods without a window, at the excited lines alone: no leakage.
Spectra spectra_by_periods(const Channel& input, const Channel& output, const Period& period, double sample_s,
                           const ExcitedLines& excited);

// Which lines of Welch's average may hold the excitation.
struct WelchLimits {
  std::vector<double> near_hz;  // within two lines of one of these; empty: all
  std::optional<double> to_hz;  // what is coherent above may be noise that a controller returns
};

// Welch's average over the segments that hold one window. Averages count as far as their windows hold the line. Lines
// at which the signals hold no more than what leaks from stronger ones have no averages, nor have those outside the
// limits or above four tenths of the sample rate. Nothing where no segment is long enough.
std::optional<Spectra> spectra_by_welch(const Channel& input, const Channel& output,
                                        std::span<const data::Segment> segments, double sample_s, std::size_t window,
                                        const WelchLimits& limits = {});

// One line of G = conj(X) Y / |X|^2 (H1).
struct ResponseLine {
  double frequency_hz = 0.0;
  std::complex<double> response;  // corrected for the hold of the input and the difference of the output
  double coherence = 0.0;         // magnitude squared
  // Radius of the 95 % confidence circle around the response, over its amplitude (J. S. Bendat and A. G. Piersol,
  // Random Data, 4th ed., eq. 9.78): r^2 = (0.05^(-1/(K-1)) - 1) (1 - coherence) / coherence with K averages;
  // and of known distortion as a circular normal deviation.
  double band = 0.0;
  // Standard deviation of the amplitude over the amplitude, and of the phase in rad.
  double std = 0.0;
  bool trusted = false;  // band below a half, and coherence above: below, feedback may bias it
};

// Lines with at least two averages. `input` and `output` state what is to be corrected.
std::vector<ResponseLine> response_of(const Spectra& spectra, const Channel& input, const Channel& output,
                                      double sample_s);

// At most so many lines, spread evenly over the logarithm of the frequency; of each part the one with the least
// uncertainty.
std::vector<ResponseLine> thinned(std::span<const ResponseLine> lines, std::size_t most);

}  // namespace flexspline::measurement
