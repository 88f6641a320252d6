// Draws a machine with its imperfections and records.
#pragma once

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {

// `stress`: imperfections that no effect of the catalogue is are 2 to 6 times as large. `draw` counts the attempts with
// this seed. What is hidden has no size yet.
Machine draw_machine(std::uint64_t seed, int draw, Kind kind, bool stress);

}  // namespace flexspline::worlds::machines
