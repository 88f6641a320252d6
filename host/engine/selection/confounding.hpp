// Why the data cannot distinguish effects, and where in the data an effect shows.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// A candidate that is confounded with the model's effects: how similar it is to the effect that is named for both.
ConfoundingReason compare_with_model(BalanceSearch& search, const CandidateFit& candidate);

// Whether both scale all torques, as the motor's constant and the gain of the torque sensor do, and no torque that is
// known otherwise decides which it is. Their scores differ, as one regresses on the measured current and the other on
// the measured torque, whose noise differs.
bool is_scale_confounded(const BalanceSearch& search, const CandidateFit& first, const CandidateFit& second);

// Whether `first` is an offset (it needs both directions and reads no motion), `second` depends on the angle alone, and
// likelihood does not distinguish them: over a short travel an effect of the angle looks like an offset, although it is
// no wider form of the same law.
bool is_angle_confounded(const CandidateFit& first, const CandidateFit& second);

// How large a torque is on the samples of the fit. `own`: what the model cannot replace of it, N m (N on a linear
// axis).
EffectSize size_of(const BalanceSearch& search, const Eigen::VectorXd& own, const model::Drive& drive);

// For each named effect, where it shows and how large its torque is; for effects that are named together, how similar
// they are in these data: what of the torque of each, orthogonal to the model, is orthogonal to the model with the
// other as well, and over which variable they do the same. Not for a delay that is described by its lag.
void explain_named(BalanceSearch& search, const std::vector<CandidateFit>& candidates, const model::Drive& drive,
                   Diagnosis& result);

}  // namespace flexspline::selection
