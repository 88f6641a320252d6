// Torques that terms read, without the noise that is in the target as well.
#pragma once

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::selection {

// Puts the torque that position and load make (least squares of each record) in the place of the measured one wherever
// the difference is white noise: noise of the sensor is in the target, too, and a term that reads it would explain
// itself. Returns in how many records.
std::size_t take_noise_off_torque(estimation::PreparedData& prepared);

// Without a torque sensor: the torque that weight and inertia of the model make, for terms that read a torque. Nothing
// where the model has no weight on the output.
void take_torque_from_load(estimation::PreparedData& prepared, const estimation::Terms& terms);

}  // namespace flexspline::selection
