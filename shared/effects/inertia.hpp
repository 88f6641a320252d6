#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct Inertia : Stateless {
  static constexpr Description kInfo{
      .name = "inertia",
      .reads = kMotorMotion,
      .equation = "J a",
      .shows_over = "acceleration",
      .source = "report eq. 26",
      .explanation = "The rotor, the coupling and the wave generator resist every change of speed.",
      .consequence = "Every acceleration takes torque; too small a value in the model makes fast motion lag.",
      .causes = "Always there. A value far from the data sheet points to a wrong torque constant or a loose coupling.",
      .check =
          "Compare with the data sheets of rotor, coupling and wave generator; check the set screw or clamp between "
          "them.",
      .confused_with = "current_delay",
      .separated_by = "the same amplitude at a second frequency",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "inertia", .symbol = "J", .unit = units::kInertia, .usual = 1.0e-4, .low = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight inertia;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(inertia);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.acceleration_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.inertia * in.acceleration;
  }
};
FLEXSPLINE_EFFECT(1, Inertia);

}  // namespace flexspline::effects
