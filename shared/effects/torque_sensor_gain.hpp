#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueSensorGain : Stateless {
  static constexpr Description kInfo{
      .name = "torque_sensor_gain",
      .balance = Balance::transmission,
      .reads = kTorque | kCurrent | kTorqueScale,
      .equation = "ratio times the modelled T, in the measured T only; motor balance -ratio/(1+ratio) T/N",
      .shows_over = "scale",
      .source = "bridge",
      .explanation = "The torque sensor reads too much (ratio positive), or too little.",
      .consequence =
          "Loads and stiffness come out too large or too small by the same share, and torque control gives too much or "
          "too little.",
      .causes = "Calibration of the bridge, a part of the load that bypasses it.",
      .check =
          "Hang a known weight on a known lever and compare; look for a load path around the sensor, such as a stiff "
          "cable.",
      .confused_with = "torque_constant_error,linear_stiffness",
      .separated_by = "a known weight on a known lever",
      .adds_to = on(Balance::motor) | on(Balance::load),
      .identified_on_motor = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "ratio", .unit = units::kNone, .kind = Kind::nonlinear, .usual = 0.03, .low = -0.3, .high = 0.3},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::Weight motor;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(motor);
    }
  };
  // The share ratio/(1 + ratio) of the measured torque does not exist.
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P share = p[0] / (P(1.0) + p[0]);
    return {N::weight(share), N::weight(-share * d.output_torque_base / (d.gear_ratio * d.torque_base))};
  }
  // A sensor error is not a torque: it is subtracted where the reading is used as the torque.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.transmission += c.torque * in.torque;
    out.load += c.torque * in.torque;
    out.motor += c.motor * in.torque;
  }
};
FLEXSPLINE_EFFECT(42, TorqueSensorGain);

}  // namespace flexspline::effects
