#pragma once

#include <cstdint>

#include "firmware/three_phase.hpp"
#include "hil/motor/power_stage.hpp"
#include "hil/motor/shunts.hpp"
#include "hil/plant/parameters.hpp"

namespace flexspline::board {

/// A three-phase motor with the torque constant of a drive, and a power stage for it.
struct ThreePhaseParameters {
  motor::MotorParameters motor;
  motor::InverterParameters inverter;
  motor::SensorParameters sensors;
};
/// Of each drive in proportion to its largest current and its rated voltage, so that the numbers per unit are the same.
ThreePhaseParameters three_phase_of(const plant::Drive& drive);
/// What is in such a drive's memory once it was commissioned.
firmware::ThreePhaseSettings three_phase_settings_of(const plant::Drive& drive);

/// The amplifier of a three-phase drive: the firmware's stage on the twin's motor and power stage, several PWM periods
/// a tick. Rotor and encoder are those of the mechanical plant.
class ThreePhaseAmplifier {
 public:
  static constexpr std::uint32_t kPwmHz = 40'000;

  /// Throws std::invalid_argument where a tick is not a whole number of PWM periods.
  ThreePhaseAmplifier(const plant::Drive& drive, std::uint32_t tick_hz, std::uint64_t seed);

  /// One tick; the rotor is at this angle now and turns at this speed. Returns the mean torque of the tick as a current
  /// of the drive's torque constant, A.
  double run(const firmware::Actuation& actuation, double motor_angle_rad, double motor_velocity_rad_s);
  /// As the drive reads it: 2^-15 of its full scale.
  std::int16_t reading() const { return stage_.current(); }
  /// The same, A.
  double current_a() const;

  firmware::ThreePhaseStage& stage() { return stage_; }
  motor::PowerStage& power() { return power_; }

 private:
  ThreePhaseParameters p_;
  double torque_constant_;
  double full_scale_a_;
  int counts_;
  int periods_;  // a tick
  motor::PowerStage power_;
  motor::Shunts shunts_;
  firmware::ThreePhaseStage stage_;
  firmware::ThreePhaseStage::Outputs out_;
};

}  // namespace flexspline::board
