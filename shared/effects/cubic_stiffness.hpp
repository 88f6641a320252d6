#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CubicStiffness : Stateless {
  static constexpr Description kInfo{
      .name = "cubic_stiffness",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "K3 dq^3",
      .shows_over = "torsion, odd",
      .source = "report eq. 37, 77",
      .explanation = "The spring gets stiffer the more it is twisted.",
      .consequence =
          "The resonance rises with the load, so a controller that is damped at rest may ring under load, or the other "
          "way round.",
      .causes = "Usual in strain-wave gears: more teeth share the load as it grows. Wear also looks like a soft start.",
      .check =
          "Measure the angle of the locked output at a tenth, half and all of the rated torque and compare with the "
          "maker's stiffness steps.",
      .confused_with = "backlash,piecewise_stiffness",
      .separated_by = "two multi-sines: a small amplitude about zero, and one up to the peak torque",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "stiffness", .symbol = "K3", .unit = {"N*m/rad^3", "N/m^3"}, .usual = 3e8},
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
    return {N::weight(p[0] * d.torsion_base * d.torsion_base * d.torsion_base / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.transmission += c.stiffness * N::times(in.torsion, N::times(in.torsion, in.torsion));
  }
};
FLEXSPLINE_EFFECT(31, CubicStiffness);

}  // namespace flexspline::effects
