#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct DahlFriction : DahlBristle {
  static constexpr Description kInfo{
      .name = "dahl_friction",
      .reads = kMotorMotion | kMotorAngle,
      .equation = "replaces coulomb_friction: sigma z, z' = w (1 - s(w) sigma z/Ts), sigma = Ts/presliding",
      .shows_over = "travel since reversal",
      .source = "Dahl",
      .explanation =
          "After each reversal friction does not jump: the contacts bend like bristles first, and friction builds "
          "up over a short travel (presliding).",
      .consequence =
          "Small commands move the axis and spring back; it settles slowly on the last few counts of the encoder.",
      .causes = "Elastic contacts in the mesh and bearings, preload, seals. Makes fine positioning springy.",
      .check =
          "Make a very small slow triangle of torque and look whether the angle follows as a spring does; check "
          "preload and seals.",
      .confused_with = "lugre_friction,coulomb_friction",
      .separated_by = "small slow motion that reverses often",
      .replaces = "coulomb_friction",
      .surface = "dry friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "Ts", .unit = units::kTorque, .usual = 0.045, .low = 0.0},
      {.name = "presliding",
       .unit = units::kAngle,
       .kind = Kind::nonlinear,
       .usual = 0.05,
       .low = 1e-12,
       .limit = Limit::travel},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::StepGain per_travel;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_travel);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.torque_base), N::step_gain(d.angle_base / p[1])};
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.torque * N::times(N::narrow(state.deflection), in.coulomb_scale);
  }
};
FLEXSPLINE_EFFECT(10, DahlFriction);

}  // namespace flexspline::effects
