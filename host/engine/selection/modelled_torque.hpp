// Torques that terms read, without the noise that is in the target as well.
#pragma once

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::selection {

// Puts the torque that position and load make (least squares of each record) in the place of the measured one wherever
// the difference is white noise: noise of the sensor is in the target, too, and a term that reads it would explain
// itself. Returns in how many records.
std::size_t take_noise_off_torque(estimation::PreparedData& prepared);

}  // namespace flexspline::selection
