#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct PowerLawFriction : Stateless {
  static constexpr Description kInfo{
      .name = "power_law_friction",
      .reads = kMotorMotion | kDirection,
      .equation = "c abs(w/wref)^d s(w), 0 < d < 1, wref = rated velocity",
      .shows_over = "velocity, concave",
      .source = "grease shear thinning",
      .explanation =
          "Friction grows with speed, but ever more slowly: the lubricant thins as it is sheared (sublinear "
          "friction).",
      .consequence =
          "The torque rises steeply at slow speed and little at high speed: a linear viscous law is wrong at both "
          "ends.",
      .causes = "Grease; its kind and temperature set the exponent. Usual in strain-wave gears.",
      .check = "Hold five or more speeds from slow to rated and plot the current; note grease and temperature.",
      .confused_with = "viscous_friction,stribeck_gaussian",
      .separated_by = "steady motion at five or more speeds from slow to rated",
      .surface = "viscous friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "c", .unit = units::kTorque, .usual = 0.02, .low = 0.0},
      {.name = "exponent",
       .symbol = "d",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 0.4,
       .low = 0.15,
       .high = 0.85},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::RatioGain per_velocity;
    typename N::Exponent exponent;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_velocity), c(exponent);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.torque_base), N::ratio_gain(d.velocity_base / d.rated_velocity), N::exponent(p[1])};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.torque * N::times(N::pow_abs(N::ratio(c.per_velocity, in.velocity), c.exponent), in.direction);
  }
};
FLEXSPLINE_EFFECT(7, PowerLawFriction);

}  // namespace flexspline::effects
