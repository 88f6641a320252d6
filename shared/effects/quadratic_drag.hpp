#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct QuadraticDrag : Stateless {
  static constexpr Description kInfo{
      .name = "quadratic_drag",
      .reads = kMotorMotion,
      .equation = "c w abs(w)",
      .shows_over = "velocity, convex",
      .source = "churning",
      .explanation = "The lubricant is churned: friction grows with the square of speed.",
      .consequence = "The top speed is lower and the gear warmer than expected; slow motion does not show it.",
      .causes = "Too much oil or grease, or one that is too thick for the speed; a fan on the shaft.",
      .check =
          "Check the amount and kind of lubricant against the maker's table; look for a fan or a brush on the shaft.",
      .confused_with = "viscous_friction,power_law_friction",
      .separated_by = "steady motion at five or more speeds from slow to rated",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "c", .unit = {"N*m*s^2/rad^2", "N*s^2/m^2"}, .usual = 4e-7, .low = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight coefficient;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(coefficient);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.velocity_base * d.velocity_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.coefficient * N::times(in.velocity, in.speed);
  }
};
FLEXSPLINE_EFFECT(21, QuadraticDrag);

}  // namespace flexspline::effects
