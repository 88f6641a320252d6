// Correction of torque readings for an effort with zero-order hold.
#pragma once

#include "host/engine/estimation/record.hpp"

namespace flexspline::estimation {

// A held effort accelerates the motor in steps, and through a transmission whose damping follows within the sample the
// load, too. A sensor that is read as the new value begins then shows the torque before its step, where positions give
// the mean acceleration of both sides: the reading lacks half a step. With rigid shafts a step of the effort E makes
// one of J/(N J_all) in the torque, J being the output's inertia and J_all that of all, at the motor.
//
// Both inertias are estimated from all free records together, and so is how much of the half step the readings lack.
struct HeldStep {
  double torque_per_step = 0.0;  // step of the torque per step of the effort; zero: not known
  bool lacks = false;            // more than half of the half step is missing for certain
  bool may_lack = false;         // or it is not certain that no more than half of it is
};
// `prepared.pipeline.torque_per_step` must be zero still.
HeldStep held_step(const PreparedData& prepared);
// Adds the other half of the steps to `torque` of a record (not to the inputs of effects), where it is free.
void correct_zero_order_hold(Record& record, const catalogue::DriveConstants<double>& constants,
                             double torque_per_step);

}  // namespace flexspline::estimation
