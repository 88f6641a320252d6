// The records of a machine: motion, load, temperature and times of the samples.
#pragma once

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {

// Also sets the reference temperature of the friction to the middle of what the records have.
void draw_records(Machine& machine, Dice& dice);

}  // namespace flexspline::worlds::machines
