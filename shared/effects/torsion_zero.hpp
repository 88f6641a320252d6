#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorsionZero : Stateless {
  static constexpr Description kInfo{
      .name = "torsion_zero",
      .balance = Balance::transmission,
      .phase = Phase::shift,
      .reads = kTorsion | kTorque,
      .equation = "shift: dq + a constant",
      .shows_over = "per record",
      .source = "integrated tachometer",
      .explanation = "The torsion is counted from a wrong zero: motor and output position have no common one.",
      .consequence = "The spring seems loaded at rest; stiffness seems to differ by direction.",
      .causes =
          "Incremental encoders that start at zero at any angle of the axis, positions integrated from a tachometer.",
      .check = "Let the axis rest without load and zero both positions there, or use absolute encoders or an index.",
      .confused_with = "torque_offset,quadratic_stiffness",
      .separated_by = "locked load with a torque far from zero, or positions that are referenced",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "angle",
       .unit = units::kAngle,
       .kind = Kind::nonlinear,
       .usual = 1e-4,
       .limit = Limit::torsion,
       .per_record = true},
  };
  template <class N>
  struct Coefficients {
    typename N::Value angle;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(angle);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::value(p[0] / d.torsion_base)};
  }
  template <class N>
  static void shift(const Coefficients<N>& c, Inputs<N>& in) {
    in.torsion = in.torsion + c.angle;
  }
};
FLEXSPLINE_EFFECT(44, TorsionZero);

}  // namespace flexspline::effects
