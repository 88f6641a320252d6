// Checks of what a fit would name although the data are too short or too one-sided to show it: placebo orders, parts of
// the data, both directions.
#pragma once

#include <string>
#include <vector>

#include "host/selection/candidate_fits.hpp"

namespace flexspline::selection {

// Refuses effects that come in orders per turn (and would be named) where the order explains no more than orders that
// no drive has, on all balances on which the effect acts together, or where it shows in a part of the data only. The
// list stays best first. `all`: the searches of every balance; `own`: the one whose candidates these are.
void check_orders(const std::vector<BalanceSearch*>& all, BalanceSearch& own, std::vector<CandidateFit>& candidates);

// "The axis moves one way only ...": what differs by direction is not identifiable then. Empty where it moves both
// ways.
std::string one_direction_warning(const BalanceData& data);

}  // namespace flexspline::selection
