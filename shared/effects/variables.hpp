// The names of the signals that a table may depend on and a formula may read.
#pragma once

#include <cstdint>

#include "shared/effects/effect.hpp"

namespace flexspline::effects {

// Written into model files by name and into parameter blocks by number; numbers are not reused.
enum class Variable : std::uint8_t {
  velocity,
  speed,
  acceleration,
  motor_angle,
  output_velocity,
  output_acceleration,
  output_angle,
  torsion,
  torsion_rate,
  torque,
  torque_magnitude,
  current,
  temperature,
};

struct VariableInfo {
  Variable variable{};
  std::string_view name{};
  Unit unit{};
  unsigned reads = 0;  // Signals
  std::string_view meaning{};
  bool periodic = false;  // repeats after a turn
};

inline constexpr VariableInfo kVariables[] = {
    {Variable::velocity, "velocity", units::kVelocity, kMotorMotion, "of the motor"},
    {Variable::speed, "speed", units::kVelocity, kMotorMotion, "magnitude of the motor's velocity"},
    {Variable::acceleration, "acceleration", {"rad/s^2", "m/s^2"}, kMotorMotion, "of the motor"},
    {Variable::motor_angle, "motor_angle", {"rad", "rad"}, kMotorMotion | kMotorAngle, "within a turn of it", true},
    {Variable::output_velocity, "output_velocity", units::kVelocity, kOutputMotion, "of the output"},
    {Variable::output_acceleration, "output_acceleration", {"rad/s^2", "m/s^2"}, kOutputMotion, "of the output"},
    {Variable::output_angle,
     "output_angle",
     {"rad", "rad"},
     kOutputMotion | kOutputAngle,
     "within a turn of it; rotary axes",
     true},
    {Variable::torsion, "torsion", units::kAngle, kTorsion, "motor angle over gear ratio, less output angle"},
    {Variable::torsion_rate, "torsion_rate", units::kVelocity, kTorsion, "its rate"},
    {Variable::torque, "torque", units::kTorque, kTorque, "through the flexspline, output side"},
    {Variable::torque_magnitude, "torque_magnitude", units::kTorque, kTorque, "its magnitude"},
    {Variable::current, "current", units::kCurrent, kCurrent, "of the motor"},
    {Variable::temperature, "temperature", {"degC", "degC"}, kTemperature, "of housing or lubricant"},
};

// A signal that is not an angle; zero for angles. The variable is a coefficient, so this does not branch on a value.
template <class N>
constexpr typename N::Value signal_of(Variable variable, const Inputs<N>& in) {
  switch (variable) {
    case Variable::velocity:
      return in.velocity;
    case Variable::speed:
      return in.speed;
    case Variable::acceleration:
      return in.acceleration;
    case Variable::output_velocity:
      return in.output_velocity;
    case Variable::output_acceleration:
      return in.output_acceleration;
    case Variable::torsion:
      return in.torsion;
    case Variable::torsion_rate:
      return in.torsion_rate;
    case Variable::torque:
      return in.torque;
    case Variable::torque_magnitude:
      return in.torque_magnitude;
    case Variable::current:
      return in.current;
    case Variable::temperature:
      return in.temperature;
    case Variable::motor_angle:
    case Variable::output_angle:
      break;
  }
  return {};
}

// The base of a signal on a drive.
template <class P>
constexpr P base_of(Variable variable, const DriveConstants<P>& d) {
  switch (variable) {
    case Variable::velocity:
    case Variable::speed:
      return d.velocity_base;
    case Variable::acceleration:
      return d.acceleration_base;
    case Variable::output_velocity:
      return d.output_velocity_base;
    case Variable::output_acceleration:
      return d.output_acceleration_base;
    case Variable::torsion:
      return d.torsion_base;
    case Variable::torsion_rate:
      return d.torsion_rate_base;
    case Variable::torque:
    case Variable::torque_magnitude:
      return d.output_torque_base;
    case Variable::current:
      return d.current_base;
    case Variable::temperature:
      return d.temperature_base;
    case Variable::motor_angle:
    case Variable::output_angle:
      break;
  }
  return P(1.0);
}

// The direction of friction on a balance.
template <class N>
constexpr typename N::Value direction_on(Balance balance, const Inputs<N>& in) {
  return balance == Balance::motor          ? in.direction
         : balance == Balance::transmission ? in.torsion_direction
                                            : in.output_direction;
}

// The sum of torques of a balance.
template <class N>
constexpr typename N::Sum& torque_on(Balance balance, Torques<N>& torques) {
  return balance == Balance::motor          ? torques.motor
         : balance == Balance::transmission ? torques.transmission
                                            : torques.load;
}

}  // namespace flexspline::effects
