#pragma once

#include "hil/plant/parameters.hpp"

namespace flexspline::plant {

/// Value of a waveform of unit amplitude and one cycle per unit of `phase`; all but `composite` and `square` start at
/// zero, rising. `composite` is eq. 60 of the report, cos + 0.5 sin 2 + sin 3, divided by its largest magnitude.
/// `asymmetric_sine` has a negative half 1.2 times the positive one. `trapezoid` spends a tenth of the cycle on each
/// ramp from zero.
double waveform(Waveform shape, double phase);

/// Set points of a plan at each sample, in the unit of its amplitude; faded in over the first quarter of a second.
std::vector<double> commands(const ExperimentPlan& plan, double sample_s);

}  // namespace flexspline::plant
