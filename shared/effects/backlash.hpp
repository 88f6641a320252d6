#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct Backlash : Stateless {
  static constexpr Description kInfo{
      .name = "backlash",
      .balance = Balance::transmission,
      .phase = Phase::shift,
      .reads = kTorsion | kTorque,
      .equation = "shift: dead zone of dq, half_width to each side",
      .shows_over = "torsion near zero",
      .source = "lost motion",
      .explanation =
          "Around zero torque the output can be moved a little without any torque: the spring has a gap in its "
          "middle.",
      .consequence =
          "At each change of the torque's sign the output rests while the motor crosses the gap, then is hit: "
          "knocking, a lost angle, limit cycles about a position.",
      .causes = "Play of a coupling, key or bolt in the load path, worn teeth. New strain-wave gears have almost none.",
      .check =
          "Hold the motor and move the output by hand at both ends of the gap with a dial gauge; look for a loose key, "
          "bolt or coupling; count hours on the teeth.",
      .confused_with = "cubic_stiffness",
      .separated_by = "small multi-sine about zero torque in locked load",
      .acts_last = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "half_width",
       .unit = units::kAngle,
       .kind = Kind::nonlinear,
       .usual = 1.5e-4,
       .low = 0.0,
       .limit = Limit::torsion},
  };
  template <class N>
  struct Coefficients {
    typename N::Value half_width;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(half_width);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::value(p[0] / d.torsion_base)};
  }
  template <class N>
  static void shift(const Coefficients<N>& c, Inputs<N>& in) {
    in.torsion = in.torsion - N::clamp(in.torsion, c.half_width);
  }
};
FLEXSPLINE_EFFECT(16, Backlash);

}  // namespace flexspline::effects
