// A set point of position that keeps to limits of position, velocity and acceleration for every sequence of commands,
// and arrives at its target exactly and without overshoot, in as short a time as the limits allow (to a tick).
//
// It counts in integers on the host and on the drive: positions in 2^-32 turns with a fraction of 16 bits, velocity v
// in 2^-48 turns a tick, and A the largest change of it a tick. p[k] = p[k-1] + v[k]. From v the drive can stop, losing
// A a tick, within
//   D(v) = (v - A) + (v - 2 A) + ... = n v - A n (n + 1)/2,   v = n A + r,  0 <= r < A.
// Of all v[k] that differ from v[k-1] by at most A, the largest one towards the target is taken that leaves room to
// stop: v + D(v) <= distance. Then v - A does so in the next tick, so a solution always exists.
#pragma once

#include <bit>
#include <cstdint>

#include "shared/effects/effect.hpp"
#include "shared/fixed/bits.hpp"
#include "shared/fixed/elementary.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::control {

// In the units of the motor's position (rad on a rotary axis) and seconds; positions in 2^-32 turns of the motor.
template <class P>
struct TrajectorySetup {
  P velocity_limit{};
  P acceleration_limit{};
  std::int64_t lowest = -(std::int64_t{1} << 62);
  std::int64_t highest = std::int64_t{1} << 62;
};

struct Trajectory {
  static constexpr int kFractionBits = 16;
  static constexpr int kMostDistanceBits = 61;  // 8192 turns: larger distances are limited to this

  template <class N>
  struct Coefficients {
    std::int64_t lowest = 0;
    std::int64_t highest = 0;
    std::int64_t velocity = 0;  // largest, 2^-48 turns a tick
    std::int64_t change = 0;    // largest, of the velocity a tick; at least one
    typename N::DistanceGain to_velocity{};
    typename N::DistanceGain to_acceleration{};
    std::int64_t velocity_base = 0;  // 2^-48 turns a tick
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.position(lowest), c.position(highest), c.speed(velocity), c.speed(change);
      c(to_velocity), c(to_acceleration), c.factor(velocity_base);
    }
  };
  struct State {
    std::int64_t position = 0;  // 2^-32 turns
    std::int64_t fraction = 0;  // of it, 2^-16
    std::int64_t velocity = 0;
    std::int64_t steps = 0;  // whole multiples of `change` in the velocity's magnitude
  };
  // At the end of a tick: position, and velocity and acceleration as differences of it (mean over the tick), in bases.
  template <class N>
  struct SetPoint {
    typename N::Angle position{};
    typename N::Value velocity{};
    typename N::Value acceleration{};
  };

  // Host only. Records limits that are not representable in OverflowLog: less than a unit a tick, or more than 8192
  // turns to stop in.
  template <class N, class P>
  static Coefficients<N> derive(const TrajectorySetup<P>& setup, const effects::DriveConstants<P>& d) {
    const double units = 0x1p48 / static_cast<double>(d.angle_base);  // a position base is a turn
    const double velocity = static_cast<double>(setup.velocity_limit * d.time_base) * units;
    const double change = static_cast<double>(setup.acceleration_limit * d.time_base * d.time_base) * units;
    const bool fits = change >= 1.0 && velocity >= 1.0 && velocity < 0x1p47 && change < 0x1p47 &&
                      velocity * (velocity / change + 4.0) + 4.0 * change < 0x1p61;
    Coefficients<N> c;
    if (!fits || setup.lowest > setup.highest) {
      fixed::OverflowLog::note(
          "limits of a trajectory: above a unit a tick, below half a turn a tick, 8192 turns to stop");
      c.change = 1;
      return c;
    }
    c.lowest = setup.lowest;
    c.highest = setup.highest;
    c.velocity = static_cast<std::int64_t>(velocity);
    c.change = static_cast<std::int64_t>(change);
    c.velocity_base = static_cast<std::int64_t>(static_cast<double>(d.velocity_base * d.time_base) * units);
    const P per_tick = d.angle_base / d.time_base / P(0x1p16);  // of a unit of velocity, read as 2^-32 turns
    c.to_velocity = N::distance_gain(per_tick / d.velocity_base);
    c.to_acceleration = N::distance_gain(per_tick / d.time_base / d.acceleration_base);
    return c;
  }

  // At rest at a position (2^-32 turns).
  static constexpr State at(std::int64_t position) { return {position, 0, 0, 0}; }
  // At a position with a velocity, as at a change of mode; limits apply from here on. One division, by bits, as a
  // library's of 64 bits is larger than all this file; so not for every tick. `velocity` in 2^-48 turns a tick.
  template <class N>
  static constexpr State moving(const Coefficients<N>& c, std::int64_t position, std::int64_t velocity) {
    const std::int64_t v = fixed::limited(velocity, -c.velocity, c.velocity);
    State s{position, 0, v, 0};
    auto rest = static_cast<std::int64_t>(fixed::size_of(v));
    const int widest = std::countl_zero(static_cast<std::uint64_t>(c.change)) - std::countl_zero(fixed::size_of(v));
    for (int bit = widest; bit >= 0; --bit) {
      if ((rest >> bit) < c.change) continue;
      rest -= c.change * (std::int64_t{1} << bit);
      s.steps += std::int64_t{1} << bit;
    }
    return s;
  }

  // One tick towards `target` (2^-32 turns), no faster than `speed` (2^-48 turns a tick) where that is less than the
  // limit: so a command of velocity is a target at the end of the range and a speed.
  template <class N>
  static constexpr SetPoint<N> update(State& s, const Coefficients<N>& c, std::int64_t target,
                                      std::int64_t speed = std::int64_t{1} << 62) {
    const std::int64_t before = s.velocity;
    const std::int64_t left = distance(s, fixed::limited(target, c.lowest, c.highest));
    // In the direction of the target.
    const bool backwards = left < 0;
    const std::int64_t v = backwards ? -before : before;
    const std::int64_t next = next_velocity(v, s.steps, backwards ? -left : left, c.change,
                                            fixed::limited<std::int64_t>(speed, 0, c.velocity));
    move(s, backwards ? -next : next, c.change);
    return {N::angle(s.position), N::narrow(N::signal(c.to_velocity, N::steps(s.velocity))),
            N::narrow(N::signal(c.to_acceleration, N::steps(s.velocity - before)))};
  }
  // A velocity in bases as `update` takes it.
  template <class N>
  static constexpr std::int64_t speed_of(const Coefficients<N>& c, fixed::Value velocity) {
    return fixed::multiply_word_round(c.velocity_base, velocity.raw, fixed::kValueBits);
  }
  static constexpr bool arrived(const State& s, std::int64_t target) {
    return s.velocity == 0 && s.fraction == 0 && s.position == target;
  }

 private:
  // The remaining distance, in 2^-48 turns.
  static constexpr std::int64_t distance(const State& s, std::int64_t target) {
    constexpr std::int64_t kMost = std::int64_t{1} << (kMostDistanceBits - kFractionBits);
    const auto whole =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(target) - static_cast<std::uint64_t>(s.position));
    return fixed::limited(whole, -kMost, kMost) * (std::int64_t{1} << kFractionBits) - s.fraction;
  }
  // v + D(v) of v = n A: A n (n + 1)/2.
  static constexpr std::int64_t stopping_distance(std::int64_t n, std::int64_t change) {
    return n * (n + 1) / 2 * change;
  }

  // The next velocity towards a target `left` >= 0 away; n is the number of whole A in the magnitude of v.
  static constexpr std::int64_t next_velocity(std::int64_t v, std::int64_t n, std::int64_t left, std::int64_t change,
                                              std::int64_t limit) {
    const std::int64_t slowest = v - change;
    std::int64_t fastest = v + change;
    if (fastest > limit) fastest = slowest > limit ? slowest : limit;
    if (fastest <= 0) return fastest;
    // `fastest` is positive: count the whole A in it, from those of v, as a tick changes them by one at most.
    std::int64_t m = v < 0 ? 0 : n;
    if (fastest - m * change < 0) --m;
    if (fastest - m * change >= change) ++m;
    const std::int64_t above = fastest - m * change;
    if (stopping_distance(m, change) + (m + 1) * above <= left) return fastest;
    // Too fast: the largest velocity that can still stop has at most as many A; if none can stop, slow down by A.
    for (int i = 0; i < 3 && m > 0 && stopping_distance(m, change) > left; ++i) --m;
    const std::int64_t over = left - stopping_distance(m, change);
    if (over < 0) return slowest;
    const std::int64_t best = m * change + divided(over, m + 1);
    return best < slowest ? slowest : best > fastest ? fastest : best;
  }
  // over/parts without a division: rounded down, or smaller by 2^-27 of it, but never larger, as then it could not
  // stop.
  static constexpr std::int64_t divided(std::int64_t over, std::int64_t parts) {
    if (parts == 1) return over;
    constexpr std::uint32_t kError = 4;
    const fixed::Reciprocal r = fixed::reciprocal_of(static_cast<std::uint64_t>(parts));
    return static_cast<std::int64_t>(
        fixed::multiply_down(static_cast<std::uint64_t>(over), r.mantissa - kError, fixed::kMantissaBits - r.exponent));
  }
  static constexpr void move(State& s, std::int64_t velocity, std::int64_t change) {
    const auto size = static_cast<std::int64_t>(fixed::size_of(velocity));
    // After zero the magnitude starts again below A.
    if ((velocity < 0) != (s.velocity < 0)) s.steps = 0;
    if (size - s.steps * change < 0) --s.steps;
    if (size - s.steps * change >= change) ++s.steps;
    s.velocity = velocity;
    const std::int64_t fine = s.fraction + velocity;
    s.fraction = fine & ((std::int64_t{1} << kFractionBits) - 1);
    s.position = static_cast<std::int64_t>(static_cast<std::uint64_t>(s.position) +
                                           static_cast<std::uint64_t>(fine >> kFractionBits));
  }
};

}  // namespace flexspline::control
