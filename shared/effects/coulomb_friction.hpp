#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CoulombFriction : Stateless {
  static constexpr Description kInfo{
      .name = "coulomb_friction",
      .reads = kMotorMotion | kDirection,
      .equation = "Ts s(w)",
      .shows_over = "direction",
      .source = "report eq. 27, 48",
      .explanation = "Dry friction: the same torque against every motion, whatever its speed.",
      .consequence =
          "The axis sticks at every reversal until the torque has built up: flat tops in slow position sines, a dead "
          "zone of the controller.",
      .causes = "Preload of the tooth mesh and bearings, seals. More after tight assembly, less after wear.",
      .check =
          "Raise the current slowly until the motor turns, in both directions and at several angles; a value that grew "
          "since assembly means preload, a seal or a dry bearing.",
      .confused_with = "dahl_friction",
      .separated_by = "small slow motion that reverses often",
      .surface = "dry friction",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "Ts", .unit = units::kTorque, .usual = 0.045, .low = 0.0},
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
    return {N::weight(p[0] / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.torque * N::times(in.direction, in.coulomb_scale);
  }
};
FLEXSPLINE_EFFECT(3, CoulombFriction);

}  // namespace flexspline::effects
