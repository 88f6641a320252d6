#pragma once

#include <string>
#include <vector>

#include "tests/worlds/drives/case.hpp"
#include "tests/worlds/drives/simulate.hpp"

namespace flexspline::worlds::drives {

/// A record as the user has it. Columns that are not there are empty; units are those of the contract.
struct Measured {
  std::string name;
  bool is_holdout = false;
  double rate_hz = 0.0;
  std::vector<double> time_s;
  std::vector<double> current_a;
  std::vector<double> motor_position_rad;
  std::vector<double> motor_velocity_rad_s;
  std::vector<double> output_position_rad;
  std::vector<double> torque_nm;
  std::vector<double> load_torque_nm;
  std::vector<double> temperature_c;
  std::vector<double> dry_friction_share;  // of the true contact, which no user has
};

/// Values of a trace's column at any time, linear between steps, its ends kept.
double value_at(const std::vector<double>& column, double step_s, double time_s);

/// What the sensors make of a trace: delays, the current's filter, steps of encoders and converters, noise, jitter.
Measured measure(const Case& drive, const RecordPlan& plan, const Trace& trace);

/// Simulates and measures the records of the case; with `only_fit` those that are fitted.
std::vector<Measured> recordings(const Case& drive, bool only_fit);

}  // namespace flexspline::worlds::drives
