// Resonances and anti-resonances of a frequency response, with damping and uncertainty.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "host/engine/measurement/frequency_response.hpp"

namespace flexspline::measurement {

struct Resonance {
  bool anti = false;
  double frequency_hz = 0.0;  // undamped
  double frequency_std_hz = 0.0;
  double damping = 0.0;  // ratio
  double damping_std = 0.0;
  // The half-power band is narrower than two lines: the window of the average widens it.
  bool damping_is_upper_limit = false;
};

struct ResonanceSearch {
  std::vector<Resonance> found;   // by frequency
  std::size_t unexplained = 0;    // extrema that no pole or zero explains: noise, or no linear response
  std::size_t trusted_lines = 0;  // in all
  double from_hz = 0.0;           // band of the trusted lines, zero where there are none
  double to_hz = 0.0;
  std::string why_not;  // a sentence without a full stop where there are too few lines
};

// Maxima and minima of the amplitude over the trusted lines that stand out by 3 dB and twice their uncertainty. About
// each, a rational function of s of second to fourth order is fitted to the complex response: Sanathanan and Koerner's
// iteration, then with instruments from the fit itself (P. C. Young), so that noise does not bias the damping. The pole
// nearest gives a resonance, the zero nearest an anti-resonance; extrema that none explains are counted only.
// Deviations are scaled by what the fit leaves over where that is more than noise.
ResonanceSearch find_resonances(std::span<const ResponseLine> response, double resolution_hz, bool windowed);

}  // namespace flexspline::measurement
