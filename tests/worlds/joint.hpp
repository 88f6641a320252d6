// A robot's joint with strain-wave gear in closed position control. Torques and angles at the motor, if not said
// otherwise.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/worlds/friction.hpp"
#include "tests/worlds/trajectory.hpp"

namespace flexspline::worlds {

struct Ripple {
  int order = 2;  // per motor turn
  double amplitude = 0.0, phase = 0.0;
};

struct ElasticLoad {
  double stiffness = 0.0, damping = 0.0;  // at the output
  double coulomb = 0.0, viscous = 0.0;    // of the load, at the output
};

// What no catalogue holds. One of these at a time; `size` in N m of the motor.
enum class SecondStructure { none, bump_over_angle, creep, neighbour_vibration, friction_that_lags, wave_over_travel };

struct Joint {
  double gear_ratio = 100.0;
  double torque_constant = 0.05;
  double motor_inertia = 1e-4;
  double load_inertia = 0.5;  // at the output

  double coulomb = 0.05, viscous = 3e-4;
  PreslidingLaw law = PreslidingLaw::dahl;
  double presliding_length = 0.5;
  double presliding_growth = 0.0;  // of the length, per rated torque
  bool presliding_present = true;  // else friction turns round at once: for the share of the error alone
  double rated_torque = 40.0;      // at the output

  double stribeck = 0.0, stribeck_velocity = 5.0;
  double viscous_asymmetry = 0.0, coulomb_asymmetry = 0.0;
  double power_torque = 0.0, power_exponent = 0.5, power_velocity = 100.0;
  double quadratic_drag = 0.0;
  double load_friction = 0.0;
  double saturation = 0.0;  // of the torque constant, 1/A^2
  double temperature_viscous = 0.0, temperature_coulomb = 0.0;
  std::optional<Ripple> ripple;
  double gravity_cosine = 0.0, gravity_sine = 0.0;  // at the output
  std::optional<ElasticLoad> elastic;

  SecondStructure second = SecondStructure::none;
  double second_size = 0.0, second_place = 0.0, second_width = 1.0;
};

// What differs from record to record.
struct RecordConditions {
  double friction_forward = 1.0, friction_backward = 1.0;
  double temperature_start_c = 0.0, temperature_rise_c = 0.0;  // against the reference; the rise goes with 20 s
  double viscous_drift = 0.0;                                  // warm-up that no column shows: share lost by the end
  double coloured_friction = 0.0;                              // standard deviation, N m
  double external_torque = 0.0;                                // amplitude of the neighbours' torque, at the output
  std::vector<double> pulses_s;
  double pulse_torque = 0.0;
  std::uint64_t seed = 0;
};

struct Controller {
  double bandwidth_hz = 10.0;
  double feedforward_error = 0.1;
  double period_s = 0.25e-3;  // short, so that the current that is held leads by less than the samples can show
};

// All that happened, at every step from `start_s` on.
struct Motion {
  double start_s = 0.0, step_s = 0.0;
  std::vector<double> angle, velocity, acceleration;  // of the motor
  std::vector<double> output_angle;
  std::vector<double> current;      // through the motor
  std::vector<double> load_torque;  // through the gear, at the output
  std::vector<double> temperature;  // against the reference
  std::vector<double> direction;    // friction over its level, from -1 to 1: the sign of the velocity with presliding

  std::size_t size() const { return angle.size(); }
};

// From `lead_s` before the trajectory's start to its end, in steps of `step_s` with friction as it is at each step: the
// velocity first, then the position by it.
Motion simulate(const Joint& joint, const RecordConditions& conditions, const Controller& controller,
                const Trajectory& trajectory, double step_s);

}  // namespace flexspline::worlds
