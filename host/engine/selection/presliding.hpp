// Presliding: a state that follows the travel since the last reversal, in the place of the sign of the velocity.
#pragma once

#include <optional>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

// Travels of presliding, rad of the motor: `state` is that of the law, which replaces the sign of the velocity; `shape`
// are shorter and longer ones. Real friction has bristles of unlike lengths (generalised Maxwell slip, Al-Bender 2005),
// so that the state of one travel alone leaves structure around reversals that other laws would be chosen for.
struct PreslidingTravels {
  double state = 0.0;
  std::vector<double> shape;
  // `state` is longer than the least that the noise of the position lets show. The least one may be dry friction on an
  // axis that sticks: it takes any value up to its limit there, while the position tells nothing.
  bool is_resolved = true;
};

// The state of Dahl's law along a record, -1 to 1, advanced by travel (exact for one direction).
std::vector<double> presliding_state(const estimation::Record& record, double travel);

// Squares that the model alone leaves with each travel of presliding, over the samples of the motor balance.
std::vector<double> squares_by_travel(const estimation::PreparedData& prepared, const estimation::Terms& terms,
                                      const std::vector<double>& travels);

// Travels of presliding that the data can show, motor side; empty where there are too few reversals.
std::vector<double> presliding_travels(const estimation::PreparedData& prepared, const SelectionPolicy& policy);

}  // namespace flexspline::selection
