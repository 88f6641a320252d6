// A stream of set points of position from a host, each with its velocity and acceleration. Between two of them the
// drive extrapolates the last one:
//   v[k] = clamp(v[k-1] + a, v_limit),  p[k] = p[k-1] + (v[k-1] + v[k])/2,
// so that a host with a period of 1 ms gives a smooth set point at every tick. Limits of position, velocity and
// acceleration are those of the trajectory. Jumps between set points are not smoothed; the loops limit their effect.
// Integers on the host and on the drive, as in trajectory.hpp.
#pragma once

#include "shared/control/trajectory.hpp"
#include "shared/fixed/coefficients.hpp"

namespace flexspline::control {

struct Stream {
  struct Coefficients {
    std::int64_t acceleration_base = 0;  // 2^-48 turns a tick, a tick
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.factor(acceleration_base);
    }
  };
  struct State {
    std::int64_t position = 0;  // 2^-32 turns
    std::int64_t fraction = 0;  // of it, 2^-16
    std::int64_t velocity = 0;  // 2^-48 turns a tick
    std::int64_t change = 0;    // of the velocity a tick
  };

  // Host only.
  template <class P>
  static Coefficients derive(const effects::DriveConstants<P>& d) {
    const double units = 0x1p48 / static_cast<double>(d.angle_base);
    const double base = static_cast<double>(d.acceleration_base * d.time_base * d.time_base) * units;
    return {fixed::nearest(base, 0x1p46, "the base of acceleration is above a quarter of a turn a tick, a tick")};
  }
  // The host's set point for this tick. Values in bases, each is clamped to its limit.
  template <class N>
  static constexpr State at(const Coefficients& c, const Trajectory::Coefficients<N>& limits, fixed::Angle position,
                            fixed::Value velocity, fixed::Value acceleration) {
    const std::int64_t v = Trajectory::speed_of<N>(limits, velocity);
    const std::int64_t a = fixed::multiply_word_round(c.acceleration_base, acceleration.raw, fixed::kValueBits);
    return {fixed::limited(position.raw, limits.lowest, limits.highest), 0, fixed::limited_to(v, limits.velocity),
            fixed::limited_to(a, limits.change)};
  }
  // One tick: the set point of this tick; afterwards the state is that of the next tick.
  template <class N>
  static constexpr Trajectory::SetPoint<N> update(State& s, const Trajectory::Coefficients<N>& limits) {
    const Trajectory::SetPoint<N> point{N::angle(s.position),
                                        N::narrow(N::signal(limits.to_velocity, N::steps(s.velocity))),
                                        N::narrow(N::signal(limits.to_acceleration, N::steps(s.change)))};
    const std::int64_t next = fixed::limited_to(s.velocity + s.change, limits.velocity);
    const std::int64_t fine = s.fraction + ((s.velocity + next) >> 1);
    s.change = next - s.velocity;
    s.velocity = next;
    s.fraction = fine & ((std::int64_t{1} << Trajectory::kFractionBits) - 1);
    const auto moved = static_cast<std::uint64_t>(fine >> Trajectory::kFractionBits);
    const auto position = static_cast<std::int64_t>(static_cast<std::uint64_t>(s.position) + moved);
    s.position = fixed::limited(position, limits.lowest, limits.highest);
    return point;
  }
};

}  // namespace flexspline::control
