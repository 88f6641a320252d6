#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct OutputCoulombFriction : Stateless {
  static constexpr Description kInfo{
      .name = "output_coulomb_friction",
      .balance = Balance::load,
      .reads = kOutputMotion,
      .equation = "Ts3 s(wo)",
      .shows_over = "direction",
      .source = "report eq. 43",
      .explanation = "Dry friction of the output bearing: the same torque against every motion of the link.",
      .consequence =
          "The link stays where it stopped although the gear is still twisted: the torque at rest is uncertain by this "
          "amount.",
      .causes = "Preload and seal of the output bearing, cables that drag.",
      .check =
          "Uncouple the motor and turn the link by hand or with a spring balance; look for dragging cables and a tight "
          "seal.",
      .confused_with = "coulomb_friction",
      .separated_by = "a torque sensor",
      .surface = "the output's dry friction",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "Ts3", .unit = units::kTorque, .usual = 0.6, .low = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.load += c.torque * in.output_direction;
  }
};
FLEXSPLINE_EFFECT(19, OutputCoulombFriction);

}  // namespace flexspline::effects
