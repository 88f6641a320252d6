#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueSensorRipple : Stateless {
  static constexpr Description kInfo{
      .name = "torque_sensor_ripple",
      .balance = Balance::transmission,
      .reads = kTorque | kMotorAngle,
      .equation = "a cos(k q) + b sin(k q), in the measured T only; motor balance with -1/N",
      .shows_over = "motor angle, not in motion",
      .source = "report 5.3",
      .explanation =
          "The torque sensor reads a ripple that repeats with the motor angle and does not act on the drive: "
          "strain gauges on the flexspline are bent by each lobe of the wave generator that passes.",
      .consequence =
          "The torque signal ripples twice a turn of the motor although the axis runs evenly; torque control turns it "
          "into a real ripple.",
      .causes = "Gauges on the flexspline itself; misalignment of the gauges.",
      .check =
          "Turn slowly without load: the reading must be flat. Check the gauges' pattern (opposed pairs cancel the "
          "ripple) and filter or map it.",
      .confused_with = "torque_ripple,kinematic_error",
      .separated_by = "slow constant speed over many turns without load",
      .adds_to = on(Balance::motor) | on(Balance::load),
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order",
       .symbol = "k",
       .unit = units::kNone,
       .kind = Kind::given,
       .usual = 2.0,
       .low = 0.01,
       .high = 1000.0},
      {.name = "cosine", .symbol = "a", .unit = units::kTorque, .usual = 0.3},
      {.name = "sine", .symbol = "b", .unit = units::kTorque, .usual = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Harmonic output;
    typename N::Harmonic motor;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(output), c(motor);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P order = p[0] * d.turn_angle_scale * d.angle_base;
    const P motor = P(-1.0) / (d.gear_ratio * d.torque_base);
    return {N::harmonic(order, p[1] / d.output_torque_base, p[2] / d.output_torque_base),
            N::harmonic(order, p[1] * motor, p[2] * motor)};
  }
  // A sensor error is not a torque: it is subtracted where the reading is used as the torque.
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Sum ripple = N::wave(c.output, in.angle);
    out.transmission += ripple;
    out.load += ripple;
    out.motor += N::wave(c.motor, in.angle);
  }
};
FLEXSPLINE_EFFECT(43, TorqueSensorRipple);

}  // namespace flexspline::effects
