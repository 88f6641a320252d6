// What the other torque balances say of an effect: many act on two of them, with the same parameters.
#pragma once

#include <vector>

#include "host/diagnosis/trials.hpp"

namespace flexspline::diagnosis {

// For each trial of `told` above the limit, judges its effect on every other balance that it acts on, with the
// parameters that `told` found: a ripple of the torque sensor and an error of the gear look alike where the spring
// twists, but only the gear's error turns the motor. The scores go to `Trial::elsewhere`, what is refuted there is
// refused, and the trials are put in order again. `all` holds the searches of every balance, `told` the one whose
// trials these are.
void hear_other_balances(const std::vector<Search*>& all, Search& told, std::vector<Trial>& trials);

}  // namespace flexspline::diagnosis
