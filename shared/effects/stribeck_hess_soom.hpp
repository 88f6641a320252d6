#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct StribeckHessSoom : Stateless {
  static constexpr Description kInfo{
      .name = "stribeck_hess_soom",
      .reads = kMotorMotion | kDirection,
      .equation = "s(w) F/(1+(w/vs)^2), F by direction",
      .shows_over = "low velocity",
      .source = "Hess and Soom; report eq. 52",
      .explanation =
          "Friction is higher near standstill and falls with speed, as with stribeck_gaussian, but with a "
          "longer tail towards fast motion.",
      .consequence =
          "Slow motion jerks (stick-slip) over a wide range of speed, and the axis overshoots as it breaks loose.",
      .causes = "Boundary lubrication, thick or old grease, long standstill.",
      .check =
          "Creep at slow speeds and listen; run the axis warm and repeat; look at the age and the amount of grease.",
      .confused_with = "stribeck_gaussian,load_dependent_friction,power_law_friction",
      .separated_by = "a slow free triangle of velocity that reaches five times the Stribeck velocity",
      .family = "stribeck",
      .negative_means = "friction rises out of standstill, so that slow motion starts smoothly",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "amplitude_positive", .symbol = "F (forward)", .unit = units::kTorque, .usual = 0.012},
      {.name = "amplitude_negative", .symbol = "F (backward)", .unit = units::kTorque, .usual = 0.012},
      {.name = "velocity",
       .symbol = "vs",
       .unit = units::kVelocity,
       .kind = Kind::nonlinear,
       .usual = 3.0,
       .low = 1e-6,
       .limit = Limit::velocity},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight positive;
    typename N::Weight negative;
    typename N::RatioGain per_velocity;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(positive), c(negative), c(per_velocity);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P half(0.5);
    return {N::weight(half * p[0] / d.torque_base), N::weight(half * p[1] / d.torque_base),
            N::ratio_gain(d.velocity_base / p[2])};
  }
  // s (1 + s) / 2 and s (1 - s) / 2 choose the amplitude of the direction without a branch.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value fall = N::lorentzian(N::ratio(c.per_velocity, in.velocity));
    const typename N::Value odd = N::times(in.direction, fall);
    const typename N::Value even = N::times(in.direction, odd);
    out.motor += c.positive * (odd + even) + c.negative * (odd - even);
  }
};
FLEXSPLINE_EFFECT(22, StribeckHessSoom);

}  // namespace flexspline::effects
