#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct OutputViscousFriction : Stateless {
  static constexpr Description kInfo{
      .name = "output_viscous_friction",
      .balance = Balance::load,
      .reads = kOutputMotion,
      .equation = "Tv3 wo",
      .shows_over = "output velocity",
      .source = "report eq. 43",
      .explanation = "Lubricant in the output bearing resists the faster, the more it is sheared.",
      .consequence = "The link is damped; fast motion takes more torque through the gear.",
      .causes = "Output bearing and its seal; grease when cold.",
      .check = "Uncouple the motor, let the link swing and see how soon it stops, cold and warm.",
      .confused_with = "viscous_friction",
      .separated_by = "a torque sensor",
      .surface = "the output's viscous friction",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "Tv3", .unit = units::kViscous, .usual = 0.5, .low = 0.0},
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
    return {N::weight(p[0] * d.output_velocity_base / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.load += c.coefficient * in.output_velocity;
  }
};
FLEXSPLINE_EFFECT(18, OutputViscousFriction);

}  // namespace flexspline::effects
