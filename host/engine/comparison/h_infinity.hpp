// The report's second measure of a model (section 4.2.2): the H-infinity norm of the transfer from the measured signal
// to the error: the largest gain over frequency, induced by the 2-norm of signals.
#pragma once

#include <cstddef>
#include <vector>

#include "host/engine/comparison/score.hpp"

namespace flexspline::comparison {

struct HInfinityNorm {
  double value = kUnknown;  // largest ratio of error to signal amplitude over the excited lines
  double low = kUnknown;    // 95 % interval of it, for all lines together; kUnknown: a single window
  double high = kUnknown;
  double frequency_hz = kUnknown;  // where it is largest
  double windows = 0.0;            // that were averaged, counted as independent ones
};

// From the spectra of both signals by Welch's method (1967; Hann windows, half overlapping). Both signals must be
// there at every sample of the segments: an error that is set to zero where rows are masked has jumps, and those have a
// spectrum of their own. Lines count below `up_to_hz` with at least a thousandth of the power of the strongest. The
// longest segment counts. Unknown where it is shorter than 64 samples or nothing is excited.
//
// The interval: the logarithm of a ratio of two power spectra with coherence c over K windows has the variance
// 2 (1 - c) / K (Bendat and Piersol, Random Data); over m lines its 95 % are Bonferroni's, 1 - 0.05 / m.
HInfinityNorm h_infinity_norm(const std::vector<double>& measured, const std::vector<double>& error,
                              const std::vector<data::Segment>& segments, double sample_hz, double up_to_hz);

}  // namespace flexspline::comparison
