// What the likelihood of all data adds to the groups that halves of the data could not distinguish, and takes from
// them.
#pragma once

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// An error of the phase, of a filter or an elastic gear, makes of a wave what a law of friction over the angle is.
// Halves of the data take either for the other, so likelihood decides which it is, or that both are one group.
void take_likelier_waves(Resampling& resampling, const SearchedBalance& motor);

// Effects whose torques are one on these data, as a weight and a ripple once a turn are without a gear, are one group:
// halves choose the one that is visible at more bandwidths. They have the same likelihood.
void add_identical_effects(Resampling& resampling, const SearchedBalance& motor);

// Groups what was found with effects of the angle that likelihood does not distinguish from it.
void add_effects_of_angle(Resampling& resampling, const SearchedBalance& motor);

}  // namespace flexspline::selection
