// What data are too short or too one-sided to tell, although a fit would name it.
#pragma once

#include <string>
#include <vector>

#include "host/diagnosis/trials.hpp"

namespace flexspline::diagnosis {

// Refuses effects that come in orders per turn (and would be named) where the order explains no more than orders that
// no drive has, on all balances on which the effect acts together, or where it shows in a part of the data only. The
// list stays best first. `all`: the searches of every balance; `told`: the one whose trials these are.
void doubt_orders(const std::vector<Search*>& all, Search& told, std::vector<Trial>& trials);

// "The axis moves one way only ...": what differs by direction cannot be told then. Empty where it moves both ways.
std::string one_way_warning(const BalanceData& data);

}  // namespace flexspline::diagnosis
