// Why the data cannot tell effects from each other, and where in the data an effect shows.
#pragma once

#include <string>
#include <vector>

#include "host/selection/candidate_fits.hpp"
#include "host/selection/diagnosis.hpp"

namespace flexspline::selection {

// A candidate that is confounded with the model's effects: how alike it is to the effect that stands for both.
ConfoundingReason compare_with_model(BalanceSearch& search, const CandidateFit& candidate);

// Whether both scale all torques, as the motor's constant and the gain of the torque sensor do, and no torque that is
// known otherwise tells which it is. Their scores differ, as one regresses on the measured current and the other on the
// measured torque, whose noise differs.
bool is_scale_confounded(const BalanceSearch& search, const CandidateFit& first, const CandidateFit& second);

// For each named effect, where it shows; for effects that are named together, how alike they are in these data: what of
// the torque of each, orthogonal to the model, is orthogonal to the model with the other as well, and over
// which variable they do the same.
void explain_named(BalanceSearch& search, const std::vector<CandidateFit>& candidates, data::Axis axis,
                   Diagnosis& result);

}  // namespace flexspline::selection
