// A regressor table at one bandwidth: its samples filtered and decimated, before masks. Made once for both masks, for
// what is held out, and for all selections that follow.
#pragma once

#include "host/engine/selection/regressor_table.hpp"

namespace flexspline::selection {

// Samples left out at each end of a run, in periods of the cut-off, where the filter guesses what lies beyond; masked
// samples reach as far around a reversal.
inline constexpr double kFilterReach = 1.5;

// Columns of a table at a lower bandwidth, with four rows a period of the cut-off, without the ends of the runs, and
// with the states of the samples. Not filtered where the table has that bandwidth.
RegressorTable filtered_table(const RegressorTable& table, ChosenColumns chosen, double cutoff_hz);

// Puts the targets of `table`, which is the one that `filtered` was made from but for its targets, in the place of
// those of `filtered`.
void filter_targets(const RegressorTable& table, RegressorTable& filtered);

}  // namespace flexspline::selection
