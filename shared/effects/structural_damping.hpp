#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct StructuralDamping : Stateless {
  static constexpr Description kInfo{
      .name = "structural_damping",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "c abs(v/vref)^alpha s(v), vref = 1 rad/s",
      .shows_over = "loop, by direction",
      .source = "report eq. 68, 75",
      .explanation =
          "Twisting the flexspline back and forth loses energy: torque against torsion draws a loop, not a line.",
      .consequence = "Vibration of the output dies out; the gear warms when it is twisted back and forth.",
      .causes = "Material and tooth contact in the flexspline; grows with preload and wear of the teeth.",
      .check =
          "Strike the link with the motor held and count the swings; compare with the value after assembly, growth "
          "means preload or wear.",
      .confused_with = "dahl_hysteresis",
      .separated_by = "the same torsion amplitude at a second frequency",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "c", .unit = units::kTorque, .usual = 57.0, .low = 0.0},
      {.name = "exponent",
       .symbol = "alpha",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 0.5,
       .low = 0.1,
       .high = 1.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::RatioGain per_rate;
    typename N::Exponent exponent;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_rate), c(exponent);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.output_torque_base), N::ratio_gain(d.torsion_rate_base), N::exponent(p[1])};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.transmission +=
        c.torque * N::times(N::pow_abs(N::ratio(c.per_rate, in.torsion_rate), c.exponent), in.torsion_direction);
  }
};
FLEXSPLINE_EFFECT(15, StructuralDamping);

}  // namespace flexspline::effects
