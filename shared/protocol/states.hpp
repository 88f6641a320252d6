// The states, commands, faults and signals of a drive. Their numbers travel between host and drive, so that each is
// stated here once, for the firmware, the store and the host. A number is never given again.
#pragma once

#include <cstddef>
#include <cstdint>

namespace flexspline::protocol {

enum class Mode : std::uint8_t {
  boot,        // sensors are looked at; amplifier off
  idle,        // amplifier off; parameters may change
  current,     // armed: a current
  velocity,    // armed: a velocity, with limits of acceleration
  position,    // armed: a position, with limits of velocity and acceleration
  excitation,  // armed: the excitation of the parameters
  stop,        // armed: comes to rest by itself, then fault
  fault,       // amplifier off until cleared
  // The motor is being measured by a three-phase stage, with limits of its own; no loop of the application runs.
  commissioning,
};
inline constexpr std::uint32_t kModes = 9;
constexpr bool is_armed(Mode mode) {
  return mode >= Mode::current && mode <= Mode::stop;
}
// Its power stage may switch.
constexpr bool is_live(Mode mode) {
  return is_armed(mode) || mode == Mode::commissioning;
}

enum class CommandKind : std::uint8_t {
  heartbeat,    // the host is there
  arm,          // idle to the armed mode `mode`; from one armed mode to another
  set,          // a new set point for `mode`, which has to be the present one
  disarm,       // to idle, amplifier off at once
  clear_fault,  // fault to boot, and to idle where the cause is gone
  // Messages of their own; in no `command`.
  start_map,  // residuals count from here on, in any mode in which the model's torque is fed forward
  stop_map,
  clear_map,   // while the drive is not armed, as it takes as long as a tick
  home,        // the shaft, at rest and not armed, is at `position`
  commission,  // measure the motor, from idle and at rest
  stop_commissioning,
};
inline constexpr std::uint32_t kCommandKinds = 5;  // in a `command`

enum class Refusal : std::uint8_t {
  none,
  armed,          // only an idle drive can do that
  not_armed,      // there is no set point to set
  other_mode,     // the set point is for another mode
  no_mode,        // that is not a mode that a drive can be commanded into
  moving,         // the shaft has to be at rest
  no_parameters,  // no valid block was committed
  no_excitation,  // the parameters hold none
  fault,          // clear it first
  booting,
  commissioning,     // the motor is being measured; stop that, or wait for its end
  no_stage,          // no three-phase power stage, or one that gives no samples
  not_commissioned,  // the motor of its stage was never measured
};
inline constexpr std::uint32_t kRefusals = 13;

// What a drive found of its stored blocks when it started.
enum class StoreState : std::uint8_t {
  empty,      // no block was ever committed
  good,       // the newest block that was committed is active
  fell_back,  // the newest one is damaged; the one before is active
  damaged,    // blocks were committed and none of them is good: there is no active one
};
inline constexpr std::uint32_t kStoreStates = 4;

enum class Fault : std::uint8_t {
  none,
  motor_encoder_stale,
  output_encoder_stale,
  analog_stale,
  motor_encoder_jump,
  motor_encoder_stuck,
  implausible_motion,
  current_out_of_range,
  torque_out_of_range,
  temperature_out_of_range,
  torque_stuck,
  current_mismatch,
  overcurrent,
  overspeed,
  overtemperature,
  host_lost,
  tick_overrun,
  watchdog,
  stop_failed,
  following_error,
  output_encoder_stuck,
  encoders_disagree,
  set_point_lost,
  amplifier_fault,
  crashed,
};
inline constexpr std::size_t kFaults = 25;

// Why a three-phase power stage switched itself off: `fault_limit` of an amplifier_fault; zero where the amplifier does
// not say why.
enum class StageFault : std::uint8_t {
  none,
  sensor_zero,  // a current sensor's zero was out of range when it was last measured; before it switches on
  bus_low,
  bus_high,
  overcurrent,  // of a phase
  current_sum,  // the three currents do not add up to zero: a sensor, or a short to ground
  driver,       // its gate driver reports a fault
  hot,
  thermistor_open,
  thermistor_shorted,
  phase_lost,
  voltage_residual,  // voltages that the motor's model does not explain: a short, a wrong angle, another motor
};
inline constexpr std::uint32_t kStageFaults = 12;

// Signals of telemetry. Values are of 2^-27 bases unless said otherwise.
enum class Channel : std::uint8_t {
  state,           // mode, fault << 8, loops limited << 16, motor's turn unknown << 17, output unknown << 18
  readings,        // motor encoder's counter
  motor_turns,     // whole turns of the motor's position
  motor_fraction,  // and the rest, 2^-32 turns
  output_turns,
  output_fraction,
  velocity,
  acceleration,
  output_velocity,
  torque,   // measured, without ripple
  current,  // measured
  temperature,
  disturbance,
  torsion,  // estimated where the output has no encoder
  set_turns,
  set_fraction,
  set_velocity,
  set_acceleration,
  feedforward_torque,
  command_torque,
  command_current,
};
inline constexpr std::size_t kChannels = 21;

}  // namespace flexspline::protocol
