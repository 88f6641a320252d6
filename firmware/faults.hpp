// All faults, and how each one stops the drive. Their names and reasons are in fault_texts.hpp, which no image needs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/protocol/states.hpp"

namespace flexspline::firmware {

using protocol::Fault;
using protocol::kFaults;

enum class SafeState : std::uint8_t {
  off,   // the amplifier is off, the shaft coasts
  stop,  // the velocity loop brings the shaft to rest with the limited deceleration; then off
};

// How long a cause has to last, in ticks, where that is not a parameter. A single bad sample of an analogue input is
// noise; an encoder that missed one or two samples still has its count.
inline constexpr std::uint32_t kStaleTicks = 3;
inline constexpr std::uint32_t kRangeTicks = 3;
inline constexpr std::uint32_t kOvercurrentTicks = 2;
inline constexpr std::uint32_t kHotTicks = 200;
// The largest age of a moving set point of a stream; it is also limited by how long a host may be silent.
inline constexpr std::uint32_t kOldestSetPointTicks = 5000;
// A torque is smoothed over so many ticks. A free shaft follows a slower torque by at least a count.
inline constexpr unsigned kTorqueSmoothingLog2 = 6;
// Share of the time until a motor's encoder counts as stuck in which a shaft comes to rest after its last count.
inline constexpr std::uint32_t kSettlingShare = 8;
// A count that stays within this distance shows no motion: with one of an encoder's two lines lost it alternates by
// one.
inline constexpr std::int32_t kRestCounts = 2;
// The share of the following error that is allowed at standstill, 2^-3; all of it at the velocity limit.
inline constexpr unsigned kFollowingFloorLog2 = 3;
// Time constant of the reference for the angle between both encoders, which drifts as the gear ratio is rounded: 2^16
// steps, at every eighth tick, are 26 s.
inline constexpr unsigned kDriftStepsLog2 = 16;
inline constexpr std::uint32_t kWatchdogTicks = 200;  // the time to which a board's watchdog has to be set

// A controlled stop, where the loops can still be relied on. Loops that do not follow cannot; those of the motor do not
// need the output's encoder.
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

// The values at detection: raw numbers, whose meaning depends on the fault.
struct FaultRecord {
  Fault fault = Fault::none;
  std::uint32_t tick = 0;
  std::int32_t seen = 0;
  std::int32_t limit = 0;
};

}  // namespace flexspline::firmware
