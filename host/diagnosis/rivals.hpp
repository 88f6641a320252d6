// Why the data cannot tell effects from each other, and where in the data an effect shows.
#pragma once

#include <string>
#include <vector>

#include "host/diagnosis/diagnosis.hpp"
#include "host/diagnosis/trials.hpp"

namespace flexspline::diagnosis {

// A candidate that the model's own effects imitate: how alike it is to the effect that stands for both.
RivalReason compare_with_model(Search& search, const Trial& candidate);

// Whether both scale all torques, as the motor's constant and the gain of the torque sensor do, and no torque that is
// known otherwise tells which it is. Their scores differ, as one regresses on the measured current and the other on the
// measured torque, whose noise differs.
bool scale_alike(const Search& search, const Trial& first, const Trial& second);

// For each named effect, where it shows; for effects that are named together, how alike they are in these data: what of
// the torque of each, beyond what the model could imitate anyway, the model with the other cannot imitate, and over
// which variable they do the same.
void explain_named(Search& search, const std::vector<Trial>& trials, data::Axis axis, Diagnosis& result);

}  // namespace flexspline::diagnosis
