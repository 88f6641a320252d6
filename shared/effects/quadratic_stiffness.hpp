#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct QuadraticStiffness : Stateless {
  static constexpr Description kInfo{
      .name = "quadratic_stiffness",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "K2 dq^2",
      .shows_over = "torsion, even",
      .source = "report eq. 69, 75",
      .explanation = "The spring is stiffer in one direction than in the other.",
      .consequence = "The output bends further one way than the other under the same load.",
      .causes =
          "A flexspline that sits off centre, a bolted joint that opens to one side; often only the result of an "
          "offset of torque or torsion.",
      .check =
          "Load the locked output by the same torque in both directions; zero the torque sensor and the positions "
          "first, then look at bolts that open to one side.",
      .confused_with = "torque_offset,torsion_zero",
      .separated_by = "large and small sines of torque about zero in locked load",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "stiffness", .symbol = "K2", .unit = {"N*m/rad^2", "N/m^2"}, .usual = 4e5},
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
    return {N::weight(p[0] * d.torsion_base * d.torsion_base / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.transmission += c.stiffness * N::times(in.torsion, in.torsion);
  }
};
FLEXSPLINE_EFFECT(30, QuadraticStiffness);

}  // namespace flexspline::effects
