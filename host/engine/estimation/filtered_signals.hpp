// The first stage of a record: the signals of an experiment, filtered, differentiated and aligned in time.
#pragma once

#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/record.hpp"

namespace flexspline::estimation {

// All of a record but its rows. Positions, where there are any, give velocity and acceleration; a tachometer helps
// where it has less noise, and stands alone without them. `prepared` gives the drive and its constants; its own
// pipeline is not read.
Record with_signals(const data::Experiment& e, const PreparedData& prepared, const Pipeline& pipeline);

// A signal through a filter, segment by segment.
std::vector<double> filtered(const std::vector<double>& signal, const std::vector<data::Segment>& segments,
                             const signals::ZeroPhaseFilter& filter);
// Its derivative, likewise.
std::vector<double> slope_of(const std::vector<double>& signal, const std::vector<data::Segment>& segments,
                             double sample_s);

}  // namespace flexspline::estimation
