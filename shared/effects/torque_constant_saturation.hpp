#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueConstantSaturation : Stateless {
  static constexpr Description kInfo{
      .name = "torque_constant_saturation",
      .reads = kCurrent,
      .equation = "Km k3 i^3",
      .shows_over = "current, at its peaks",
      .source = "magnetic saturation",
      .explanation = "At large currents the iron saturates, and an ampere makes less torque than at small ones.",
      .consequence =
          "The last amperes give little: peak acceleration and holding torque are below what the model says.",
      .causes = "A motor driven near its peak current, or one with little iron.",
      .check =
          "Hold rising known weights and plot them over the current; a line that bends is the iron. Check the motor's "
          "peak current.",
      .confused_with = "load_dependent_friction,torque_constant_error,cubic_stiffness",
      .separated_by = "a constant external load in both directions at low current",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "k3", .unit = {"1/A^2", "1/A^2"}, .usual = 5e-3, .low = 0.0},
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
    return {N::weight(p[0] * d.torque_constant * d.current_base * d.current_base * d.current_base / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.coefficient * N::times(in.current, N::times(in.current, in.current));
  }
};
FLEXSPLINE_EFFECT(27, TorqueConstantSaturation);

}  // namespace flexspline::effects
