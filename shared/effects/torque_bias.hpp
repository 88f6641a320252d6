#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueBias : Stateless {
  static constexpr Description kInfo{
      .name = "torque_bias",
      .reads = kTorqueInput | kBothDirections,
      .equation = "tau0",
      .shows_over = "bias",
      .source = "drives that report torque or force, not current",
      .explanation = "The given torque or force is off by a constant.",
      .consequence = "The axis seems to be pushed one way, moving or not.",
      .causes = "Offset of the drive's torque signal, or a constant load such as weight on a vertical axis.",
      .check =
          "Read the torque signal with the drive off; look for a weight, a spring or a counterbalance on the axis.",
      .confused_with = "coulomb_asymmetry",
      .separated_by = "a record with the drive off",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "tau0", .unit = units::kTorque, .usual = 0.003},
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
    return {N::value(p[0] / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.motor += N::sum(c.torque);
  }
};
FLEXSPLINE_EFFECT(13, TorqueBias);

}  // namespace flexspline::effects
