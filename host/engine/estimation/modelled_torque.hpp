// The torque through the gear where no sensor measures it.
#pragma once

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::estimation {

// Puts what the weight on the output and the inertia of a model with values make of the torque through the gear, N m on
// its output, in the place of the measured one, on top of a logged load: most of both is behind the gear. Nothing
// changes where a sensor measures it or the model has no weight. Returns whether it was set.
bool take_torque_from_load(PreparedData& prepared, const Terms& terms);
// Whether an effect of the motor balance reads that torque.
bool reads_torque(const Terms& terms);
// The same where the model has an effect that reads that torque.
bool take_torque_where_read(PreparedData& prepared, const Terms& terms);

}  // namespace flexspline::estimation
