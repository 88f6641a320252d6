#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CurrentOffset : Stateless {
  static constexpr Description kInfo{
      .name = "current_offset",
      .reads = kCurrent | kBothDirections,
      .equation = "Km i0, i0 = what the sensor reads at zero current",
      .shows_over = "bias, also at rest",
      .source = "amplifier",
      .explanation = "The current sensor does not read zero at zero current, so every torque is off by a constant.",
      .consequence =
          "The axis creeps when zero current is commanded, and seems to have more friction one way than the other.",
      .causes = "Offset of the current sensor or of the amplifier's monitor output; drifts with temperature.",
      .check =
          "Read the current sensor with the power stage off; redo the amplifier's offset calibration, warm and cold.",
      .confused_with = "coulomb_asymmetry",
      .separated_by = "a record with the drive off",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "current", .symbol = "i0", .unit = units::kCurrent, .usual = 0.05},
  };
  template <class N>
  struct Coefficients {
    typename N::Value torque;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::value(p[0] * d.torque_constant / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.motor += N::sum(c.torque);
  }
};
FLEXSPLINE_EFFECT(12, CurrentOffset);

}  // namespace flexspline::effects
