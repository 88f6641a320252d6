// Everything that stops the drive by itself: what it is called, what it ends in, and within how many ticks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace flexspline::firmware {

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
};
inline constexpr std::size_t kFaults = 19;

enum class SafeState : std::uint8_t {
  off,   // the amplifier is off, the shaft coasts
  stop,  // the velocity loop brings the shaft to rest with the limited deceleration; then off
};

// How long a cause has to last, in ticks, where that is no parameter. A single bad sample of an analogue input is
// noise; an encoder that missed a sample or two still has its count.
inline constexpr std::uint32_t kStaleTicks = 3;
inline constexpr std::uint32_t kRangeTicks = 3;
inline constexpr std::uint32_t kOvercurrentTicks = 2;
inline constexpr std::uint32_t kHotTicks = 200;
inline constexpr std::uint32_t kWatchdogTicks = 200;  // what a board's watchdog has to be set to

struct FaultInfo {
  Fault fault = Fault::none;
  SafeState ends_in = SafeState::off;
  std::uint32_t ticks = 0;  // from the first tick that shows the cause; nought: a parameter, named in the reason
  std::string_view name{};
  std::string_view reason{};
};

inline constexpr std::array<FaultInfo, kFaults> kFaultTable{{
    {Fault::none, SafeState::off, 0, "none", "no fault"},
    {Fault::motor_encoder_stale, SafeState::off, kStaleTicks, "motor_encoder_stale",
     "the motor's encoder gave no new sample"},
    {Fault::output_encoder_stale, SafeState::off, kStaleTicks, "output_encoder_stale",
     "the output's encoder gave no new sample"},
    {Fault::analog_stale, SafeState::off, kStaleTicks, "analog_stale", "the converter gave no new samples"},
    {Fault::motor_encoder_jump, SafeState::off, 1, "motor_encoder_jump",
     "the motor's encoder moved by more counts in a tick than at twice the overspeed"},
    {Fault::motor_encoder_stuck, SafeState::off, 0, "motor_encoder_stuck",
     "the torque changed by more than friction can hold, and the motor's encoder shows no motion (stuck_torque, "
     "stuck_s)"},
    {Fault::implausible_motion, SafeState::off, 0, "implausible_motion",
     "the motor's encoder shows an acceleration that no torque can give (acceleration)"},
    {Fault::current_out_of_range, SafeState::off, kRangeTicks, "current_out_of_range",
     "the current's converter is at its rail: sensor or wire broken"},
    {Fault::torque_out_of_range, SafeState::off, kRangeTicks, "torque_out_of_range",
     "the torque's converter is at its rail: sensor or wire broken"},
    {Fault::temperature_out_of_range, SafeState::stop, kRangeTicks, "temperature_out_of_range",
     "the temperature's converter is at its rail: sensor or wire broken"},
    {Fault::torque_stuck, SafeState::stop, 0, "torque_stuck",
     "the torque sensor's reading never changed, not even by its noise (torque_same_s)"},
    {Fault::current_mismatch, SafeState::off, 0, "current_mismatch",
     "the measured current is not the commanded one: amplifier or sensor broken (current_mismatch, mismatch_s)"},
    {Fault::overcurrent, SafeState::off, kOvercurrentTicks, "overcurrent", "the measured current is above its limit"},
    {Fault::overspeed, SafeState::off, 1, "overspeed", "the motor turns faster than its limit"},
    {Fault::overtemperature, SafeState::stop, kHotTicks, "overtemperature", "the drive is too hot"},
    {Fault::host_lost, SafeState::stop, 0, "host_lost", "the host sent no command (host_s)"},
    {Fault::tick_overrun, SafeState::off, 1, "tick_overrun", "a control tick did not end before the next one was due"},
    {Fault::watchdog, SafeState::off, kWatchdogTicks, "watchdog",
     "the watchdog reset the drive: a part of the application had stopped reporting"},
    {Fault::stop_failed, SafeState::off, 0, "stop_failed", "the shaft did not come to rest in time (stop_s)"},
}};
constexpr const FaultInfo& info_of(Fault fault) {
  return kFaultTable[static_cast<std::size_t>(fault)];
}
static_assert([] {
  for (std::size_t i = 0; i < kFaults; ++i)
    if (kFaultTable[i].fault != static_cast<Fault>(i)) return false;
  return true;
}());

// What was seen when it was found: raw numbers, whose meaning depends on the fault.
struct FaultRecord {
  Fault fault = Fault::none;
  std::uint32_t tick = 0;
  std::int32_t seen = 0;
  std::int32_t limit = 0;
};

}  // namespace flexspline::firmware
