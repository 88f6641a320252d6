// A cut-off at which the mask of reversals leaves what a fit needs. The mask gets shorter as the cut-off rises, and the
// noise of the velocity larger, so that each record has a best one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::estimation {

struct CutoffRange {
  double lowest_hz = 0.0;  // the present one
  double highest_hz = 0.0;
};

struct MaskCutoff {
  double hz = 0.0;     // 0: the present one does
  std::string reason;  // what samples it leaves: a record's name, or a velocity
};

/// The smallest velocity of the model's friction laws (Stribeck) where it is given and fixed, rad/s: such a law shows
/// in slow motion alone.
std::optional<double> slowest_law_rad_s(const model::Model& model);

/// What the number of reversals does not show: slow or short strokes of which the mask leaves next to nothing in one
/// direction, because they end within the transient of the filter, or because the velocity is small for its noise; and
/// the slow samples, of all records together, that a friction law of a given velocity needs.
/// made_at(record, hz) makes a record again with another cut-off.
MaskCutoff cutoff_for_mask(const std::vector<Record>& records, const CutoffRange& range,
                           std::optional<double> law_rad_s,
                           const std::function<Record(const Record&, double)>& made_at);

}  // namespace flexspline::estimation
