// The second stage of a record: the samples that balances are fitted on, without those around reversals, and a cut-off
// at which that mask leaves what a fit needs. The mask gets shorter as the cut-off rises, and the noise of the velocity
// larger, so that each record has a best one.
#pragma once

#include <optional>

#include "host/engine/estimation/record.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::estimation {

// How far, in periods of the cut-off, the step of friction at a reversal rings through the filter.
inline constexpr double kMaskReach = 1.5;

// Chooses the rows of a record, again where it has some.
void choose_rows(Record& record, const Pipeline& pipeline);

// Whether there are samples to fit the transmission's balance on.
bool shows_torsion(const Record& record);
// Whether the mask of reversals leaves less than a fifth of the information on the stiffness, which goes with the
// square of the torsion, of records whose torsion is far above its noise: its rate is the difference of two velocities,
// and often hardly above theirs.
bool masks_most_torsion(const PreparedData& prepared);

/// The smallest velocity of the model's friction laws (Stribeck) where it is given and fixed, rad/s: such a law shows
/// in slow motion alone.
std::optional<double> slowest_law_rad_s(const model::Model& model);

/// Raises the cut-off of the pipeline, up to `highest_hz`, for what the number of reversals does not show: slow or
/// short strokes of which the mask leaves next to nothing in one direction, because they end within the transient of
/// the filter, or because the velocity is small for its noise; and the slow samples, of all records together, that a
/// friction law of a given velocity needs. Returns whether it did; the records are to be made again then.
bool raise_cutoff_for_mask(PreparedData& prepared, std::optional<double> law_rad_s, double highest_hz);

/// The same for the transmission: raises the cut-off to the lowest one at which the mask leaves enough of the torsion.
/// Where none does, the rate is hardly above its noise, the pipeline stays and the answer is false.
bool raise_cutoff_for_torsion(PreparedData& prepared, double highest_hz);

}  // namespace flexspline::estimation
