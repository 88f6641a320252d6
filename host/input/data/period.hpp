// The period of a motion that repeats itself.
#pragma once

#include <optional>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

// In samples, also between two of them; none where nothing repeats. From the longest segment: set points first, as they
// repeat exactly, then positions, then velocities. The first tenth or quarter is left out where it takes that, as
// motions are faded in. `mismatch_limit` as in signals::find_repetition.
std::optional<double> period_samples(const Experiment& experiment, double mismatch_limit = 0.02);

}  // namespace flexspline::data
