#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct ViscousAsymmetry : Stateless {
  static constexpr Description kInfo{
      .name = "viscous_asymmetry",
      .reads = kMotorMotion | kBothDirections,
      .equation = "dTv abs(w)",
      .shows_over = "velocity, even",
      .source = "report eq. 27, 62",
      .explanation = "Friction grows faster with speed in one direction than in the other.",
      .consequence = "One direction is slower than the other at the same torque, the more the faster it goes.",
      .causes =
          "Tooth flanks, bearing preload or brushes that differ by direction; a screw or an axial load; grease that "
          "is carried to one side.",
      .check =
          "Hold the same speed both ways at several speeds and compare the currents; look at brushes, axial load and "
          "where the grease went.",
      .confused_with = "coulomb_asymmetry",
      .separated_by = "both directions at two speeds that differ by a factor of five",
      .asymmetry_of = "viscous_friction",
      .direction_symbols = "Tvp,Tvn",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "dTv", .unit = units::kViscous, .usual = 1e-5},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight coefficient;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(coefficient);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.velocity_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.coefficient * in.speed;
  }
};
FLEXSPLINE_EFFECT(4, ViscousAsymmetry);

}  // namespace flexspline::effects
