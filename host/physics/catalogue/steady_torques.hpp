// Torques of an effect in steady motion, in which its memory no longer changes but for what repeats with the angle.
#pragma once

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::catalogue {

// Of an effect at rest, after a turn of the motor at the velocities and with all other signals of `in`, back at the
// angles of `in`: what repeats with the angle is the same for both directions. `in.velocity` is not zero where the
// effect has a state. `has_state` as in its Entry.
effects::Torques<Real> steady_torques(Instance& effect, bool has_state, effects::Inputs<Real> in);

}  // namespace flexspline::catalogue
