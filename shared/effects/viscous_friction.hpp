#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct ViscousFriction : Stateless {
  static constexpr Description kInfo{
      .name = "viscous_friction",
      .reads = kMotorMotion,
      .equation = "Tv w",
      .shows_over = "velocity, linear",
      .source = "report eq. 27, 48",
      .explanation = "Lubricant is sheared between moving surfaces: the faster, the more torque it takes.",
      .consequence =
          "Fast motion takes torque and warms the gear; it also damps, so too much in the model makes control weak.",
      .causes = "Grease in the wave-generator bearing and the tooth mesh; more when cold or over-filled.",
      .check = "Hold several speeds and plot the current, cold and warm; check the kind and amount of grease.",
      .confused_with = "power_law_friction",
      .separated_by = "steady motion at several speeds",
      .surface = "viscous friction",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "Tv", .unit = units::kViscous, .usual = 3.6e-4, .low = 0.0},
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
    return {N::weight(p[0] * d.velocity_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.coefficient * N::times(in.velocity, in.viscous_scale);
  }
};
FLEXSPLINE_EFFECT(2, ViscousFriction);

}  // namespace flexspline::effects
