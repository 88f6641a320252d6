// Whether the data show the period of an effect that is a wave of the output's angle with the period of a turn: over a
// small travel any slow function of the angle looks like gravity.
#pragma once

#include <vector>

#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {

// Sets CandidateFit::has_uncertain_period of such effects, and of what is the same function of the data, and refuses
// those where it is set: a wave with half the period, which has as many parameters, explains as much.
void check_output_angle_period(const BalanceSearch& search, std::vector<CandidateFit>& candidates);

}  // namespace flexspline::selection
