#pragma once

#include "hil/plant/parameters.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::plant {

/// The numbers of all effects that are present. Throws std::invalid_argument for an effect type the plant cannot
/// simulate, for one that stands twice where it cannot, and for a missing parameter.
Physics physics_of(const Drive& drive);

/// What the current sensor reads at zero current, A.
double current_offset_of(const Drive& drive);

}  // namespace flexspline::plant
