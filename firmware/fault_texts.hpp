// What faults are called, why they happen, and within how many ticks they are found. For the host's side of a drive.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/faults.hpp"

namespace flexspline::firmware {

struct FaultInfo {
  Fault fault = Fault::none;
  std::uint32_t ticks = 0;  // from the first tick that shows the cause; nought: a parameter, named in the reason
  std::string_view name{};
  std::string_view reason{};
};

inline constexpr std::array<FaultInfo, kFaults> kFaultTable{{
    {Fault::none, 0, "none", "no fault"},
    {Fault::motor_encoder_stale, kStaleTicks, "motor_encoder_stale", "the motor's encoder gave no new sample"},
    {Fault::output_encoder_stale, kStaleTicks, "output_encoder_stale", "the output's encoder gave no new sample"},
    {Fault::analog_stale, kStaleTicks, "analog_stale", "the converter gave no new samples"},
    {Fault::motor_encoder_jump, 1, "motor_encoder_jump",
     "the motor's encoder moved by more counts in a tick than at twice the overspeed"},
    {Fault::motor_encoder_stuck, 0, "motor_encoder_stuck",
     "the torque changed by more than friction can hold, and the motor's encoder shows no motion (stuck_torque, "
     "stuck_s)"},
    {Fault::implausible_motion, 0, "implausible_motion",
     "the motor's encoder shows an acceleration that no torque can give (acceleration)"},
    {Fault::current_out_of_range, kRangeTicks, "current_out_of_range",
     "the current's converter is at its rail: sensor or wire broken"},
    {Fault::torque_out_of_range, kRangeTicks, "torque_out_of_range",
     "the torque's converter is at its rail: sensor or wire broken"},
    {Fault::temperature_out_of_range, kRangeTicks, "temperature_out_of_range",
     "the temperature's converter is at its rail: sensor or wire broken"},
    {Fault::torque_stuck, 0, "torque_stuck",
     "the torque sensor's reading never changed, not even by its noise (torque_same_s)"},
    {Fault::current_mismatch, 0, "current_mismatch",
     "the measured current is not the commanded one: amplifier or sensor broken (current_mismatch, mismatch_s)"},
    {Fault::overcurrent, kOvercurrentTicks, "overcurrent", "the measured current is above its limit"},
    {Fault::overspeed, 1, "overspeed", "the motor turns faster than its limit"},
    {Fault::overtemperature, kHotTicks, "overtemperature", "the drive is too hot"},
    {Fault::host_lost, 0, "host_lost", "the host sent no command (host_s)"},
    {Fault::tick_overrun, 1, "tick_overrun", "a control tick did not end before the next one was due"},
    {Fault::watchdog, kWatchdogTicks, "watchdog",
     "the watchdog reset the drive: a part of the application had stopped reporting"},
    {Fault::stop_failed, 0, "stop_failed", "the shaft did not come to rest in time (stop_s)"},
}};
constexpr const FaultInfo& info_of(Fault fault) {
  return kFaultTable[static_cast<std::size_t>(fault)];
}
static_assert([] {
  for (std::size_t i = 0; i < kFaults; ++i)
    if (kFaultTable[i].fault != static_cast<Fault>(i)) return false;
  return true;
}());

}  // namespace flexspline::firmware
