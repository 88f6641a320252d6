#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueConstantError : Stateless {
  static constexpr Description kInfo{
      .name = "torque_constant_error",
      .reads = kCurrent | kTorqueScale,
      .equation = "-kappa Km i",
      .shows_over = "scale",
      .source = "report eq. 61: inertia supplied",
      .explanation = "The motor makes more torque per ampere than its data sheet says (kappa positive), or less.",
      .consequence =
          "All torques of the model are off by the same share: loads and inertias come out too large or too small.",
      .causes =
          "Spread of magnets and windings (10 % is usual), a warm magnet, a wrong commutation angle, peak "
          "against RMS amperes.",
      .check =
          "Hold a known weight on the output and compare the current with the data sheet's; check peak against RMS "
          "amperes and the commutation angle.",
      .confused_with = "torque_sensor_gain,torque_constant_saturation",
      .separated_by = "a known inertia or weight at the output, or the back EMF at a known speed",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "ratio", .symbol = "kappa", .unit = units::kNone, .usual = 0.2, .low = -0.5, .high = 0.5},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight ratio;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(ratio);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(-p[0] * d.torque_constant * d.current_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.ratio * in.current;
  }
};
FLEXSPLINE_EFFECT(26, TorqueConstantError);

}  // namespace flexspline::effects
