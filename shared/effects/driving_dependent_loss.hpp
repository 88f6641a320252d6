#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct DrivingDependentLoss : DahlBristle {
  static constexpr Description kInfo{
      .name = "driving_dependent_loss",
      .reads = kMotorMotion | kMotorAngle | kTorque | kBothDirections,
      .equation =
          "abs(T)/N z (d1 + d2)/2 + T/N z^2 (d1 - d2)/2, z' = (w - abs(w) z)/h: d1 abs(T)/N driving, d2 abs(T)/N "
          "driven",
      .shows_over = "torque, by direction and by travel since reversal",
      .source = "measured strain-wave drives, google-deepmind/mujoco issue 3528",
      .explanation =
          "The gear loses a share of the torque through it, another share when the motor drives the load than when the "
          "load drives the motor: its two efficiencies. After a reversal the loss builds up over a short travel.",
      .consequence =
          "Lifting takes more and lowering less torque than the load alone, by different shares; the torque of "
          "lowering is wrong where one efficiency is used for both.",
      .causes =
          "Sliding of the teeth and of the wave generator's bearing under load; the angle of the teeth's flanks makes "
          "the two directions differ.",
      .check =
          "Lift and lower the same weight at the same slow speed, and compare both currents with the one that holds it "
          "without friction; repeat with half the weight. Check lubricant and wear of the teeth.",
      .confused_with = "load_dependent_friction,torque_sensor_gain,torque_constant_error,dahl_friction",
      .separated_by =
          "external loads of several sizes, raised and lowered slowly, with a loaded torque sensor; small motions that "
          "reverse often under load show the travel",
      .contains = "load_dependent_friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "driving", .symbol = "d1", .unit = units::kNone, .usual = 0.08, .low = 0.0, .high = 1.0},
      {.name = "driven", .symbol = "d2", .unit = units::kNone, .usual = 0.04, .low = 0.0, .high = 1.0},
      {.name = "presliding",
       .symbol = "h",
       .unit = units::kAngle,
       .kind = Kind::nonlinear,
       .usual = 0.05,
       .low = 1e-12,
       .limit = Limit::travel},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight mean;  // of both shares, and half their difference
    typename N::Weight difference;
    typename N::StepGain per_travel;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(mean), c(difference), c(per_travel);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P scale = P(0.5) * d.output_torque_base / (d.gear_ratio * d.torque_base);
    return {N::weight((p[0] + p[1]) * scale), N::weight((p[0] - p[1]) * scale), N::step_gain(d.angle_base / p[2])};
  }
  // The square has no sign, so that its term has that of the torque: it adds where the motor drives.
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value carried = N::narrow(state.deflection);
    out.motor += c.mean * N::times(in.torque_magnitude, carried);
    out.motor += c.difference * N::times(in.torque, N::times(carried, carried));
  }
};
FLEXSPLINE_EFFECT(48, DrivingDependentLoss);

}  // namespace flexspline::effects
