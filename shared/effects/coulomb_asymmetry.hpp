#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CoulombAsymmetry : Stateless {
  static constexpr Description kInfo{
      .name = "coulomb_asymmetry",
      .reads = kMotorMotion | kDirection | kBothDirections,
      .equation = "dTs while moving",
      .shows_over = "bias while moving",
      .source = "report eq. 27, 62",
      .explanation =
          "Dry friction is larger in one direction than in the other: a constant torque, but only while the "
          "shaft moves.",
      .consequence =
          "One direction needs more torque than the other; with equal commands the axis creeps or ends short in one "
          "direction.",
      .causes = "Tooth flanks or seals that differ by direction, one-sided wear.",
      .check =
          "Compare the current at the same slow speed both ways, with the drive off the sensor must read zero. Look "
          "at seals, brushes and an axial load on one side.",
      .confused_with = "current_offset,torque_bias",
      .separated_by = "a record with the drive off, which shows an offset of the sensor alone",
      .asymmetry_of = "coulomb_friction",
      .direction_symbols = "Tsp,Tsn",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "dTs", .unit = units::kTorque, .usual = 1e-3},
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
  // The square of the direction is one while moving, zero at rest, and smooth between where the direction is.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.torque * N::times(in.direction, in.direction);
  }
};
FLEXSPLINE_EFFECT(5, CoulombAsymmetry);

}  // namespace flexspline::effects
