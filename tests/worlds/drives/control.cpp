#include "tests/worlds/drives/control.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::worlds::drives {

double MotionController::current_command_a(const SetPoint& set_point, double measured_rad) {
  const double period = settings_.period_s;
  const double difference = (measured_rad - last_rad_) / period;
  last_rad_ = measured_rad;
  velocity_rad_s_ += (1.0 - std::exp(-settings_.velocity_filter_rad_s * period)) * (difference - velocity_rad_s_);
  const double wanted =
      set_point.velocity_rad_s + settings_.position_gain_1_s * (set_point.position_rad - measured_rad);
  const double error = wanted - velocity_rad_s_;
  const double proportional = settings_.velocity_gain_as_rad * error;
  const double command = proportional + integral_a_ + settings_.feedforward_as2_rad * set_point.acceleration_rad_s2;
  const double limited = std::clamp(command, -settings_.current_limit_a, settings_.current_limit_a);
  is_saturated_ = limited != command;
  // The integral waits while the limit holds and the error asks for more.
  if (!is_saturated_ || proportional * command < 0.0)
    integral_a_ += settings_.integral_rate_1_s * period * proportional;
  return limited;
}

double CurrentController::step(double command_a, double velocity_rad_s, double sensor_offset_a, double step_s) {
  const double error = command_a - (current_a_ + sensor_offset_a);
  const double bandwidth = settings_.current_bandwidth_rad_s;
  const double wanted = bandwidth * settings_.inductance_h * error + integral_v_ + torque_constant_ * velocity_rad_s;
  const double voltage = std::clamp(wanted, -settings_.bus_voltage_v, settings_.bus_voltage_v);
  if (voltage == wanted) integral_v_ += bandwidth * settings_.resistance_ohm * error * step_s;
  const double decay = std::exp(-step_s * settings_.resistance_ohm / settings_.inductance_h);
  const double steady = (voltage - torque_constant_ * velocity_rad_s) / settings_.resistance_ohm;
  current_a_ = steady + (current_a_ - steady) * decay;
  return current_a_;
}

}  // namespace flexspline::worlds::drives
