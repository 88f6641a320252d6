// Everything that stops the drive by itself, and what it ends in. Names and reasons for people are in fault_texts.hpp,
// which no image needs.
#pragma once

#include <cstddef>
#include <cstdint>

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
  following_error,
  output_encoder_stuck,
  encoders_disagree,
  set_point_lost,
  amplifier_fault,
  crashed,
};
inline constexpr std::size_t kFaults = 25;

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
// A set point of a stream that moves is as old at most as a host may be silent, and no older than this.
inline constexpr std::uint32_t kOldestSetPointTicks = 5000;
// What a shaft feels of a torque: smoothed over so many ticks. A free shaft follows slower torque by a count.
inline constexpr unsigned kFeltTicksLog2 = 6;
// Share of the time before a motor's encoder counts as stuck, in which a shaft comes to rest after its last count.
inline constexpr std::uint32_t kSettlingShare = 8;
// A count that stays within so many of where it was shows no motion: with one of an encoder's two lines lost it goes to
// and fro by one.
inline constexpr std::int32_t kRestCounts = 2;
// The share of the following error that is allowed at standstill, 2^-3; all of it at the velocity limit.
inline constexpr unsigned kFollowingFloorLog2 = 3;
// How slowly the angle between both encoders may drift, as a gear ratio that is rounded makes it: 2^17 looks, at every
// fourth tick, are 26 s.
inline constexpr unsigned kDriftTurnsLog2 = 17;
inline constexpr std::uint32_t kWatchdogTicks = 200;  // what a board's watchdog has to be set to

// Where a drive can still be trusted to come to rest by itself, it does: loops that do not follow are not, those of the
// motor do not need the output's encoder.
constexpr SafeState ends_in(Fault fault) {
  switch (fault) {
    case Fault::temperature_out_of_range:
    case Fault::torque_stuck:
    case Fault::overtemperature:
    case Fault::host_lost:
    case Fault::output_encoder_stuck:
    case Fault::set_point_lost:
      return SafeState::stop;
    default:
      return SafeState::off;
  }
}

// What was seen when it was found: raw numbers, whose meaning depends on the fault.
struct FaultRecord {
  Fault fault = Fault::none;
  std::uint32_t tick = 0;
  std::int32_t seen = 0;
  std::int32_t limit = 0;
};

}  // namespace flexspline::firmware
