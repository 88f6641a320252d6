// Significance checks of candidates where data are short or one-sided: placebo orders, parts of the data, both
// directions.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {

// Refuses effects with orders per turn that would be named, where their order explains no more than placebo orders
// (over all balances on which the effect acts), or where it shows in one part of the data only. The list stays best
// first. `all`: the searches of every balance; `own`: the one whose candidates these are.
void check_orders(const std::vector<BalanceSearch*>& all, BalanceSearch& own, std::vector<CandidateFit>& candidates);

// "The axis moves one way only ...": what differs by direction is not identifiable then. Empty where it moves both
// ways.
std::string one_direction_warning(const RegressionProblem& data);

}  // namespace flexspline::selection
