// Limits that hold for any input: of a signal's slope, and of a torque at the drive's speed.
#pragma once

#include "shared/fixed/overflow_log.hpp"

namespace flexspline::control {

// Host only: records invalid values, as number systems record coefficients that do not fit.
inline void require(bool holds, std::string_view what) {
  if (!holds) fixed::OverflowLog::note(what);
}

// y[k] = y[k-1] + clamp(clamp(x[k], limit) - y[k-1], rate): reaches a constant input exactly and stays there.
struct RateLimiter {
  template <class N>
  struct Coefficients {
    typename N::Value limit;  // of the magnitude, at most two bases
    typename N::State rate;   // per tick
  };
  template <class N>
  struct State {
    typename N::State output{};
  };

  // Host only. `limit` and `rate_per_s` in the unit of `base`; rates down to 1e-18 bases a tick are exact.
  template <class N, class P>
  static Coefficients<N> derive(const P& limit, const P& rate_per_s, const P& base, const P& tick_s) {
    require(limit > P(0.0) && limit <= P(2.0) * base, "the limit of a set point is not between zero and two bases");
    const P rate = rate_per_s * tick_s / base;
    require(rate > P(0.0), "the slope of a set point has to be positive");
    // A jump from one end of the range to the other is four bases.
    const P part = rate < P(4.0) ? rate / P(4.0) : P(1.0);
    return {N::value(limit / base), N::times(N::widen(N::value(P(4.0))), N::share(part))};
  }
  // Returns the limited signal, in bases. `state.output` may be set to a start value within the limit.
  template <class N>
  static constexpr typename N::Value update(State<N>& s, const Coefficients<N>& c, typename N::Value input) {
    const auto target = N::widen(N::clamp(input, c.limit));
    s.output = s.output + N::clamp(target - s.output, c.rate);
    return N::narrow(s.output);
  }
};

// The torque that may be commanded at a speed: all of it up to `velocity_limit`, then decreasing linearly to zero at
// `overspeed` and on to the full limit as a brake. So no command accelerates a drive beyond `overspeed`, and a drive
// that its load accelerates further is braked.
struct SpeedGuard {
  template <class N>
  struct Coefficients {
    typename N::Value torque_limit;
    typename N::Value overspeed;
    typename N::Value largest_velocity;  // limit of the measured velocity
    typename N::Gain slope;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.limit(torque_limit), c.limit(overspeed), c.positive(largest_velocity), c(slope);
    }
  };
  template <class N>
  struct Bounds {
    typename N::Value low{};
    typename N::Value high{};
  };

  // Host only; all in units of their bases. Velocities below two bases, so that a tick's differences fit.
  template <class N, class P>
  static Coefficients<N> derive(const P& torque_limit, const P& velocity_limit, const P& overspeed) {
    require(torque_limit > P(0.0) && torque_limit <= P(2.0), "a torque limit is not between zero and two bases");
    require(velocity_limit > P(0.0) && velocity_limit < overspeed && overspeed <= P(2.0),
            "velocity limit and overspeed have to rise from zero to at most two bases");
    return {N::value(torque_limit), N::value(overspeed), N::value(overspeed + overspeed),
            N::gain(torque_limit / (overspeed - velocity_limit))};
  }
  // The allowed torque at a measured velocity: low <= high, both within the torque limit. Only the line on the side of
  // the velocity can be below the limit; the other one reaches the limit at the velocity limit of its side.
  template <class N>
  static constexpr Bounds<N> bounds(const Coefficients<N>& c, typename N::Value velocity) {
    return bounds_within<N>(c, N::clamp(velocity, c.largest_velocity));
  }
  // For a velocity that is limited already.
  template <class N>
  static constexpr Bounds<N> bounds_within(const Coefficients<N>& c, typename N::Value velocity) {
    const auto most = N::clamp(N::scaled(c.slope, c.overspeed - N::magnitude(velocity)), c.torque_limit);
    if (velocity < typename N::Value{}) return {-most, c.torque_limit};
    return {-c.torque_limit, most};
  }
};

}  // namespace flexspline::control
