// One rule for all limits that stop a drive: each has to be within the range of its signal, with a margin, and the
// times without a host and of a controlled stop have a largest value. A limit beyond that does not protect. The host
// checks this when it packs, and the drive's validator as well.
#pragma once

#include <cstdint>

#include "shared/control/drive_parameters.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::control {

using Shown = fixed::Fixed::Value;

// An analogue reading in bases of its signal. Signals that a model reads are limited to two bases; limits use the whole
// range.
inline Shown shown(const AnalogScale<fixed::Fixed>& scale, std::int16_t share, std::int32_t bases = 15) {
  const Shown part{{std::int32_t{share} * (1 << (fixed::kValueBits - 15))}};
  const std::int32_t value = fixed::saturated_difference(fixed::Fixed::scaled(scale.gain, part).raw, scale.offset.raw);
  return {{fixed::limited_to(value, bases * (1 << fixed::kValueBits))}};
}

enum class Limit : std::uint8_t {
  none,
  overspeed,
  overcurrent,
  overtemperature,
  acceleration,
  stuck_torque,
  current_mismatch,
  standstill,
  following_velocity,
  host_time,
  stop_time,
};

// Largest times. A host that is silent for longer is not connected; a controlled stop that takes longer has failed.
inline constexpr std::uint32_t kLongestHostSeconds = 5, kLongestStopSeconds = 30;

// The signals and limits of the rule.
struct Limited {
  using N = fixed::Fixed;
  AnalogScale<N> current{};
  AnalogScale<N> temperature{};
  SafetyLimits<N> safety{};
  Shown following_velocity{};  // zero: not watched
  Shown velocity_limit{};
  Shown torque_limit{};
  Shown current_limit{};
  N::Gain acceleration_scale{};  // of the motor's encoder filter
  std::uint32_t tick_hz = 0;

  static Limited of(const DriveSettings<N>& s) {
    return {s.current,
            s.temperature,
            s.safety,
            s.following.velocity,
            s.loops.velocity_limit,
            s.loops.torque_limit,
            s.loops.current_limit,
            s.motor_motion.acceleration_scale,
            s.tick_hz};
  }
};

// The largest that each limit may be, in its base.
inline Shown largest(Limit limit, const Limited& d) {
  const auto share = [](std::int64_t raw, int percent) {
    return Shown{{static_cast<std::int32_t>(fixed::limited<std::int64_t>(raw * percent / 100, 0, INT32_MAX))}};
  };
  constexpr std::int64_t kTwoBases = std::int64_t{2} << fixed::kValueBits;  // range of an encoder's velocity
  switch (limit) {
    case Limit::overspeed:
      return share(kTwoBases, 95);
    case Limit::overcurrent: {
      const std::int64_t above = shown(d.current, d.current.highest).raw,
                         below = -shown(d.current, d.current.lowest).raw;
      return share(above < below ? above : below, 95);
    }
    case Limit::overtemperature: {
      const std::int64_t a = shown(d.temperature, d.temperature.highest).raw;
      const std::int64_t b = shown(d.temperature, d.temperature.lowest).raw;
      return share(a > b ? a : b, 95);
    }
    case Limit::acceleration: {
      // A count that stops at the overspeed: the slower the filter, the smaller its acceleration.
      const Shown stop = share(d.safety.overspeed.raw, 30);
      return fixed::Fixed::scaled(d.acceleration_scale, stop);
    }
    case Limit::stuck_torque:
      return share(2 * std::int64_t{d.torque_limit.raw}, 95);
    case Limit::current_mismatch:
      return share(d.current_limit.raw, 95);
    case Limit::standstill:
      return share(d.velocity_limit.raw, 50);
    case Limit::following_velocity:
      return d.velocity_limit;
    default:
      return {};
  }
}
// The first limit that its signal cannot reach, or none.
inline Limit unreachable(const Limited& d) {
  const auto beyond = [&d](Limit limit, Shown is) { return is > largest(limit, d); };
  if (beyond(Limit::overspeed, d.safety.overspeed)) return Limit::overspeed;
  if (beyond(Limit::overcurrent, d.safety.overcurrent)) return Limit::overcurrent;
  if (beyond(Limit::overtemperature, d.safety.overtemperature)) return Limit::overtemperature;
  if (beyond(Limit::acceleration, d.safety.acceleration)) return Limit::acceleration;
  if (beyond(Limit::stuck_torque, d.safety.stuck_torque)) return Limit::stuck_torque;
  if (beyond(Limit::current_mismatch, d.safety.current_mismatch)) return Limit::current_mismatch;
  if (beyond(Limit::standstill, d.safety.standstill)) return Limit::standstill;
  if (beyond(Limit::following_velocity, d.following_velocity)) return Limit::following_velocity;
  if (d.safety.host_ticks > kLongestHostSeconds * d.tick_hz) return Limit::host_time;
  if (d.safety.stop_ticks > kLongestStopSeconds * d.tick_hz) return Limit::stop_time;
  return Limit::none;
}

}  // namespace flexspline::control
