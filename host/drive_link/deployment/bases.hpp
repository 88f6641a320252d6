// The bases of per-unit numbers, from the ratings of a drive.
#pragma once

#include "host/physics/catalogue/resolved_model.hpp"
#include "host/physics/model/model.hpp"
#include "shared/effects/effect.hpp"
#include "shared/model/block.hpp"

namespace flexspline::deployment {

// Known facts and bases of a drive in SI, ready for `derive`: each base is exactly the number that a block holds.
// Needs gear ratio, rated velocity
// and a rated torque or current; throws PackError naming what is missing.
effects::DriveConstants<double> bases_of(const catalogue::ResolvedModel& model, double tick_s);
// With the bases of torque wider by a factor, where a model gives more than 16 of them.
effects::DriveConstants<double> widened(effects::DriveConstants<double> bases, double torque_scale);

// What rated torque means for the share of an error: at the motor it is that of the output over the gear ratio.
double rated_output_torque(const model::Drive& drive);

model::Number number_of(double x);
double value_of(const model::Number& n);
model::Bases in_block(const effects::DriveConstants<double>& d);
effects::DriveConstants<double> from_block(const model::Bases& bases);

}  // namespace flexspline::deployment
