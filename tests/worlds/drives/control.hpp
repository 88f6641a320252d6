#pragma once

namespace flexspline::worlds::drives {

/// Cascade of position (P), velocity (PI) and current (PI), as in servo drives (Groß, Hamann, Wiegärtner, Electrical
/// Feed Drives, ch. 3).
struct ControlSettings {
  double position_gain_1_s = 0.0;
  double velocity_gain_as_rad = 0.0;
  double integral_rate_1_s = 0.0;
  double feedforward_as2_rad = 0.0;  // of the acceleration
  double velocity_filter_rad_s = 0.0;
  double current_bandwidth_rad_s = 0.0;
  double current_limit_a = 0.0;
  double resistance_ohm = 0.0;
  double inductance_h = 0.0;
  double bus_voltage_v = 0.0;
  double period_s = 0.0;
};

/// What the outer loops are to follow.
struct SetPoint {
  double position_rad = 0.0;
  double velocity_rad_s = 0.0;
  double acceleration_rad_s2 = 0.0;
};

class MotionController {
 public:
  MotionController(const ControlSettings& settings, double start_rad) : settings_(settings), last_rad_(start_rad) {}

  /// Command in A for the next period; the velocity is the filtered difference of the encoder's angles.
  double current_command_a(const SetPoint& set_point, double measured_rad);
  bool is_saturated() const { return is_saturated_; }

 private:
  ControlSettings settings_;
  double last_rad_;
  double velocity_rad_s_ = 0.0;
  double integral_a_ = 0.0;
  bool is_saturated_ = false;
};

class CurrentController {
 public:
  CurrentController(const ControlSettings& settings, double torque_constant_nm_a)
      : settings_(settings), torque_constant_(torque_constant_nm_a) {}

  /// Current in A after `step_s` in a winding with resistance, inductance and back EMF; the loop sees `sensor_offset_a`
  /// more than flows.
  double step(double command_a, double velocity_rad_s, double sensor_offset_a, double step_s);
  double current_a() const { return current_a_; }

 private:
  ControlSettings settings_;
  double torque_constant_;
  double current_a_ = 0.0;
  double integral_v_ = 0.0;
};

}  // namespace flexspline::worlds::drives
