// What is hidden in a machine, and how large it has to be.
#pragma once

#include "tests/worlds/machines/account.hpp"

namespace flexspline::worlds::machines {

HiddenEffect draw_hidden(const Machine& machine, Dice& dice);

// Puts it in at a size relative to what is usual; 0 takes it out.
void set_size(Machine& machine, double size);

// Lowers the controller's bandwidth until it holds all records, with what is hidden at a usual size. False where none
// does.
bool tune_controller(Machine& machine);

// Sizes what is hidden so that the RMS error rises as wanted, as far as that is plausible. False where it comes out far
// too large, as nothing, or the controller does not hold the machine: then another machine has to be drawn.
bool fit_size(Machine& machine);

}  // namespace flexspline::worlds::machines
