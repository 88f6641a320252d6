// Presliding: a state that follows the travel since the last reversal, in the place of the sign of the velocity.
#pragma once

#include <optional>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

// Which presliding travel replaces the sign of the velocity; nothing: the sign itself.
using Presliding = std::optional<double>;  // rad of the motor

// The state of Dahl's law along a record, -1 to 1, advanced by travel (exact for one direction).
std::vector<double> presliding_state(const estimation::Record& record, double travel);

// Squares that the model alone leaves with each travel of presliding, over the samples of the motor balance.
std::vector<double> squares_by_travel(const estimation::PreparedData& prepared, const estimation::Terms& terms,
                                      const std::vector<double>& travels);

// Travels of presliding that the data can show, motor side; empty where there are too few reversals.
std::vector<double> presliding_travels(const estimation::PreparedData& prepared, const SelectionPolicy& policy);

}  // namespace flexspline::selection
