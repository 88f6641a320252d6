#pragma once

#include <vector>

#include "tests/worlds/drives/case.hpp"

namespace flexspline::worlds::drives {

/// What happened, at each step of the simulation: not what sensors say of it.
struct Trace {
  double step_s = 0.0;
  std::vector<double> motor_position_rad;
  std::vector<double> motor_velocity_rad_s;
  std::vector<double> output_position_rad;
  std::vector<double> current_a;
  std::vector<double> gear_torque_nm;   // at the output
  std::vector<double> brake_torque_nm;  // at the output, positive resists
  std::vector<double> dry_friction_nm;  // at the motor
  double tracking_rms_rad = 0.0;
  double saturated_share = 0.0;
};

/// Temperature of a record in degC: it goes to its end by an exponential with a third of the record as time constant.
double temperature_c(const RecordPlan& plan, double share_of_record);

/// Dry friction at a step over its level at that velocity and load, from -1 to 1: under the rigid law it is the
/// direction.
double dry_friction_share(const Case& drive, const RecordPlan& plan, const Trace& trace, std::size_t step);

/// Runs one record in closed loop. What `trace` held is replaced; its memory is used again.
void simulate(const Case& drive, const RecordPlan& plan, Trace& trace);

/// Whether the controller held the motion: error below 12 % of the range, at most 8 % of the time at the current's
/// limit.
bool is_held(const RecordPlan& plan, const Trace& trace);

}  // namespace flexspline::worlds::drives
