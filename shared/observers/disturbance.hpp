// The torque at the motor's shaft that is not in the model: the residual of the motor balance, smoothed.
//   r[k] = t[k-1] - m[k-1] - J a[k]       applied less modelled torque, less the inertia's share of the acceleration
//   d[k] = d[k-1] + share (clamp(r[k], limit) - d[k-1]),  share = 1 - exp(-T/time constant)
// Acceleration and velocity come from the encoder's Kalman filter, so nothing is differentiated here and there is one
// state: a step of D is estimated as D (1 - exp(-t/time constant)), after the Kalman filter's own response. The
// inertia's torque must not be counted twice: with the model's torque from the set point, `a` is the measured less the
// set point's acceleration.
#pragma once

#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::observers {

template <class P>
struct DisturbanceSetup {
  P inertia{};          // kg m^2, of the motor's shaft and everything rigidly connected to it
  P time_constant_s{};  // of the smoothing
  P limit{};            // N m at the motor
};

struct DisturbanceObserver {
  template <class N>
  struct Coefficients {
    typename N::Gain inertia{};
    typename N::Share share{};
    typename N::Value limit{};
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(inertia), c(share), c.limit(limit);
    }
  };
  template <class N>
  struct State {
    typename N::State disturbance{};
    typename N::Value residual{};  // r of the last tick, limited
  };

  // Host only.
  template <class N, class P>
  static Coefficients<N> derive(const DisturbanceSetup<P>& s, const effects::DriveConstants<P>& d) {
    control::require(s.time_constant_s > P(0.0), "the time constant of a disturbance observer has to be positive");
    control::require(s.limit > P(0.0) && s.limit <= P(2.0) * d.torque_base,
                     "the limit of a disturbance is not between zero and two bases of torque");
    constexpr double kE = 2.718281828459045;
    return {N::gain(s.inertia * d.acceleration_base / d.torque_base),
            N::share(P(1.0) - N::power(P(kE), -d.time_base / s.time_constant_s)), N::value(s.limit / d.torque_base)};
  }
  // One tick: torques that acted since the previous tick, and the acceleration now; all within two bases. Returns the
  // disturbance in bases of torque. Positive resists the motion, as every term of the balance does.
  template <class N>
  static constexpr typename N::Value update(State<N>& s, const Coefficients<N>& c, typename N::Value applied,
                                            typename N::Value modelled, typename N::Value acceleration) {
    typename N::Sum left = N::sum(applied);
    left += N::sum(-modelled);
    left += c.inertia * -acceleration;
    s.residual = N::clamp(N::narrow(left), c.limit);
    s.disturbance = s.disturbance + N::times(N::widen(s.residual) - s.disturbance, c.share);
    return N::narrow(s.disturbance);
  }
};

}  // namespace flexspline::observers
