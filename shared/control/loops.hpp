// Cascaded loops of a drive: position (P), velocity (PI) and the command to the current controller, with limits of
// velocity, torque and current that hold for any input. Per unit; k counts ticks of T seconds, clamp(x, a) limits x to
// -a..a:
//   w_ref = clamp(Kp (q_ref - q) + w_ff, w_limit)                           position loop
//   w_ref = clamp(w_ff, w_limit)                                            velocity loop
//   e[k]  = w_ref - w
//   u[k]  = Kv e[k] + x[k] + t_ff                                           torque alone: u[k] = t_ff
//   t[k]  = u[k] limited to low..high of SpeedGuard at w, within -t_limit..t_limit
//   x[k+1] = clamp(x[k] + Ki T e[k], t_limit), but x[k] where t[k] is limited and e[k] would push it further
//   i[k]  = clamp(t[k]/Km, i_limit)
// When a loop closes, or another one does, x is set so that t[k] is what t[k-1] was: x = t[k-1] - Kv e[k] - t_ff.
#pragma once

#include <cstdint>

#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::control {

enum class Loop : std::uint8_t { off, torque, velocity, position };

// In SI units at the motor.
template <class P>
struct LoopSetup {
  P position_gain{};   // Kp, 1/s
  P velocity_gain{};   // Kv, N m s/rad
  P integral_gain{};   // Ki, N m/rad
  P velocity_limit{};  // rad/s, of the velocity loop's set point; full torque up to here
  P overspeed{};       // rad/s, where no torque is left that drives
  P torque_limit{};    // N m
  P current_limit{};   // A; the lower one of both torques holds
};

struct Loops {
  template <class N>
  struct Coefficients {
    typename N::DistanceGain position{};
    typename N::Gain velocity{};
    typename N::Share integral{};  // Ki T
    typename N::Value velocity_limit{};
    typename N::Value largest_velocity{};  // limit of the measured velocity
    typename N::Value torque_limit{};
    typename N::Value largest_torque{};  // limit of the input torque
    SpeedGuard::Coefficients<N> guard{};
    typename N::Gain current{};
    typename N::Value current_limit{};
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(position), c(velocity), c(integral), c.limit(velocity_limit), c.positive(largest_velocity);
      c.limit(torque_limit), c.positive(largest_torque), c(guard), c(current), c.limit(current_limit);
    }
  };
  template <class N>
  struct State {
    typename N::State integral{};
    typename N::Value torque{};  // of the previous tick
    Loop loop = Loop::off;
  };
  // The demand. Of the velocity loop `velocity` is the set point, of the position loop its feedforward; `torque`
  // is the set point where no loop is closed, else the feedforward.
  template <class N>
  struct Command {
    Loop loop = Loop::off;
    typename N::Angle position{};
    typename N::Value velocity{};
    typename N::Value torque{};
  };
  template <class N>
  struct Output {
    typename N::Value torque{};   // of torque_base
    typename N::Value current{};  // of current_base, for the current controller
    typename N::Value error{};    // of the velocity; zero where no loop is closed
    bool limited = false;         // the loops reached a limit
  };

  // Host only. Records gains and limits that do not fit in OverflowLog.
  template <class N, class P>
  static Coefficients<N> derive(const LoopSetup<P>& s, const effects::DriveConstants<P>& d) {
    const P by_current = s.current_limit * d.torque_constant;
    const P torque_limit = (by_current < s.torque_limit ? by_current : s.torque_limit) / d.torque_base;
    const P velocity_limit = s.velocity_limit / d.velocity_base;
    const P overspeed = s.overspeed / d.velocity_base;
    Coefficients<N> c;
    c.position = N::distance_gain(s.position_gain * d.angle_base / d.velocity_base);
    c.velocity = N::gain(s.velocity_gain * d.velocity_base / d.torque_base);
    // Above one the integral would exceed the base of the torque within a tick, which is not a useful loop.
    c.integral = N::share(s.integral_gain * d.time_base * d.velocity_base / d.torque_base);
    c.velocity_limit = N::value(velocity_limit);
    c.largest_velocity = N::value(overspeed + overspeed);
    c.torque_limit = N::value(torque_limit);
    c.largest_torque = N::value(torque_limit + torque_limit);
    c.guard = SpeedGuard::derive<N>(torque_limit, velocity_limit, overspeed);
    c.current = N::gain(d.torque_base / (d.torque_constant * d.current_base));
    c.current_limit = N::value(s.current_limit / d.current_base);
    return c;
  }

  // One tick: returns the torque and the current to command. `angle` and `velocity` are measured. Bumpless in every
  // change of the loop as far as the integral, which is within the torque limit, allows; without a loop and a torque
  // (off) it is zero at once.
  template <class N>
  static constexpr Output<N> update(State<N>& s, const Coefficients<N>& c, const Command<N>& command,
                                    typename N::Angle angle, typename N::Value velocity) {
    if (command.loop == Loop::off) {
      s = {};
      return {};
    }
    const auto w = N::clamp(velocity, c.largest_velocity);
    const auto feedforward = N::clamp(command.torque, c.largest_torque);
    typename N::Value error{};
    auto torque = feedforward;
    if (command.loop != Loop::torque) {
      error = velocity_set_point<N>(c, command, angle) - w;
      // Within eight, in addition to four of the feedforward and two of the integral: the sum fits a value, and where
      // it was clamped it is beyond every limit.
      const auto proportional = N::clamp(N::scaled(c.velocity, error), most_proportional<N>());
      if (command.loop != s.loop) s.integral = bumpless_integral<N>(c, s.torque, proportional, feedforward);
      torque = torque + N::narrow(s.integral) + proportional;
    }
    s.loop = command.loop;
    const auto bounds = SpeedGuard::bounds_within<N>(c.guard, w);
    const bool above = torque > bounds.high, below = torque < bounds.low;
    s.torque = above ? bounds.high : below ? bounds.low : torque;
    if (command.loop != Loop::torque && !(above && error > typename N::Value{}) &&
        !(below && error < typename N::Value{}))
      s.integral = N::clamp(s.integral + N::times(N::widen(error), c.integral), c.torque_limit);
    return {s.torque, N::clamp(N::scaled(c.current, s.torque), c.current_limit), error, above || below};
  }

 private:
  template <class N>
  static constexpr typename N::Value velocity_set_point(const Coefficients<N>& c, const Command<N>& command,
                                                        typename N::Angle angle) {
    const auto forward = N::clamp(command.velocity, c.largest_velocity);
    if (command.loop == Loop::velocity) return N::clamp(forward, c.velocity_limit);
    // Within four and four: the sum fits a state.
    const auto from_position = N::narrow(N::signal(c.position, command.position - angle));
    return N::clamp(from_position + forward, c.velocity_limit);
  }
  template <class N>
  static constexpr typename N::Value most_proportional() {
    const auto two = N::one() + N::one();
    return two + two + two + two;
  }
  // Limited where it becomes a state; before that it is within two, eight and four.
  template <class N>
  static constexpr typename N::State bumpless_integral(const Coefficients<N>& c, typename N::Value torque,
                                                       typename N::Value proportional, typename N::Value feedforward) {
    return N::widen(N::clamp(torque - proportional - feedforward, c.torque_limit));
  }
};

}  // namespace flexspline::control
