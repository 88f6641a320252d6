#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct LinearStiffness : Stateless {
  static constexpr Description kInfo{
      .name = "linear_stiffness",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "K1 dq",
      .shows_over = "torsion, linear",
      .source = "report eq. 37, 78",
      .explanation = "The flexspline twists under load, like a spring between motor and output.",
      .consequence =
          "The output swings after a stop and bends under load; it sets the resonance with the load's inertia.",
      .causes = "Always there. Softer than the data sheet: a loose clamp or bolt in the load path.",
      .check =
          "Apply a known torque to the output with the motor held and read the angle; look for loose bolts when it is "
          "soft.",
      .confused_with = "cubic_stiffness",
      .separated_by = "locked load at full torque and at a tenth of it",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "stiffness", .symbol = "K1", .unit = units::kStiffness, .usual = 6.3e3, .low = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight stiffness;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(stiffness);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.torsion_base / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.transmission += c.stiffness * in.torsion;
  }
};
FLEXSPLINE_EFFECT(14, LinearStiffness);

}  // namespace flexspline::effects
