#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct StribeckGaussian : Stateless {
  static constexpr Description kInfo{
      .name = "stribeck_gaussian",
      .reads = kMotorMotion | kDirection,
      .equation = "s(w) F exp(-(w/vs)^2), F by direction",
      .shows_over = "low velocity",
      .source = "Tustin; report eq. 53, 85",
      .explanation =
          "Near standstill the surfaces touch instead of floating on lubricant: friction is higher there and "
          "falls as motion gets faster. It makes slow motion jerk.",
      .consequence =
          "Slow motion jerks (stick-slip), and the axis overshoots as it breaks loose; fast motion does not show it.",
      .causes =
          "Boundary lubrication, thick or old grease, long standstill. A negative amplitude means friction that "
          "rises out of standstill.",
      .check =
          "Creep at the slowest speed that is used and listen; run the axis warm and repeat; look at the age and the "
          "amount of grease.",
      .confused_with = "load_dependent_friction,power_law_friction",
      .separated_by = "a slow free triangle of velocity",
      .family = "stribeck",
      .negative_means = "friction rises out of standstill, so that slow motion starts smoothly",
      .wide_negative_means =
          "this is sublinear friction, which grows ever more slowly with speed (see power_law_friction), not Stribeck "
          "friction",
      .wide_negative_is = "power_law_friction",
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
    typename N::Weight odd;  // half the sum of both amplitudes, and half their difference
    typename N::Weight even;
    typename N::RatioGain per_velocity;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(odd), c(even), c(per_velocity);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P half(0.5);
    return {N::weight(half * (p[0] + p[1]) / d.torque_base), N::weight(half * (p[0] - p[1]) / d.torque_base),
            N::ratio_gain(d.velocity_base / p[2])};
  }
  // The direction and its square choose the amplitude without a branch.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value bell = N::gauss(N::ratio(c.per_velocity, in.velocity));
    out.motor += c.odd * N::times(in.direction, bell);
    out.motor += c.even * N::times(N::times(in.direction, in.direction), bell);
  }
};
FLEXSPLINE_EFFECT(6, StribeckGaussian);

}  // namespace flexspline::effects
