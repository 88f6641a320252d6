#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueOffset : Stateless {
  static constexpr Description kInfo{
      .name = "torque_offset",
      .balance = Balance::transmission,
      .reads = kTorque,
      .equation = "T0, in the measured T only; motor balance -T0/N",
      .shows_over = "bias",
      .source = "K0 in report eq. 69; bridge",
      .explanation = "The torque sensor does not read zero at zero torque.",
      .consequence = "The axis seems loaded at rest; torque control drifts against it.",
      .causes = "Offset of the strain-gauge bridge or its amplifier; drifts with temperature and mounting.",
      .check =
          "Read the sensor with the output free and at rest, in several positions; zero the bridge amplifier when it "
          "is warm.",
      .confused_with = "torsion_zero,quadratic_stiffness,current_offset,coulomb_asymmetry",
      .separated_by = "a record with the output free and the drive off",
      .adds_to = on(Balance::motor) | on(Balance::load),
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "T0", .unit = units::kTorque, .usual = 0.2},
  };
  template <class N>
  struct Coefficients {
    typename N::Value torque;
    typename N::Value motor;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(motor);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::value(p[0] / d.output_torque_base), N::value(-p[0] / (d.gear_ratio * d.torque_base))};
  }
  // A sensor error is not a torque: it is subtracted where the reading is used as the torque.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += N::sum(c.torque);
    out.load += N::sum(c.torque);
    out.motor += N::sum(c.motor);
  }
};
FLEXSPLINE_EFFECT(41, TorqueOffset);

}  // namespace flexspline::effects
