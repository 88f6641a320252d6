// Odd and even nonlinear distortion, distinguished by the lines of the spectrum that a linear drive would leave empty.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/measurement/channels.hpp"
#include "host/engine/measurement/period.hpp"

namespace flexspline::measurement {

struct DistortionLevel {
  std::size_t lines = 0;     // of detection
  double level_db = 0.0;     // against the excited lines; minus infinity where there is nothing
  double noise_db = 0.0;     // of the same lines, with the stated steps of an encoder, against the same
  double rms = 0.0;          // of these lines together, without the noise, in the signal's unit
  double p_value = 1.0;      // of as much power by noise alone (F test)
  bool significant = false;  // p_value below 0.001 and above -100 dB
};

enum class Excitation {
  kOddMultisine,  // odd lines alone, some of them left out
  kSine,
  kOther,
};

struct Distortion {
  std::string input, output;
  std::string unit;  // of the output
  Excitation excitation = Excitation::kOther;
  std::size_t excited_lines = 0;
  double low_hz = 0.0, high_hz = 0.0;  // excited band
  std::optional<DistortionLevel> odd, even;
  std::string odd_why_not, even_why_not;  // a sentence without a full stop, empty where the level is there
};

// After R. Pintelon and J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 4.3: with excited
// odd lines alone, an even nonlinearity answers at even lines, an odd one at odd lines, and both show where nothing was
// excited. The means over the periods are tested; what the input holds at these lines (a controller answers the
// distortion) is taken off as response times input, the response interpolated between excited lines. Levels are mean
// powers of a line of each kind within the excited band over those of an excited line.
// Of a single sine the harmonics up to the 20th are summed up, without such correction.
Distortion distortion_of(const Channel& input, const Channel& output, const Period& period, double sample_s,
                         const ExcitedLines& excited);

}  // namespace flexspline::measurement
