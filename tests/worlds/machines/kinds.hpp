// The ranges of each kind of machine.
#pragma once

#include <vector>

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {

// Catalogue names of what may be hidden in a kind.
const std::vector<std::string_view>& candidates(Kind kind);

// Mechanics, rates and sensors; nothing hidden, no imperfections, no records.
Machine draw_kind(Kind kind, Dice& dice);

// The position controller's bandwidth.
double draw_bandwidth_rad_s(const Machine& machine, Dice& dice);

}  // namespace flexspline::worlds::machines
