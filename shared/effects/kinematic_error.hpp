#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct KinematicError : Stateless {
  static constexpr Description kInfo{
      .name = "kinematic_error",
      .balance = Balance::transmission,
      .phase = Phase::shift,
      .reads = kTorsion | kTorque | kMotorAngle,
      .equation = "shift: dq + e(q), e = cosine cos(k q) + sine sin(k q); motor: T e'(q)",
      .shows_over = "motor angle",
      .source = "Tuttle",
      .explanation =
          "The gear does not turn the output evenly: over a turn of the motor the output leads and lags "
          "by some arc seconds. At the motor it is a ripple that grows with the load.",
      .consequence =
          "The output leads and lags twice a turn of the motor; at a certain speed this meets the resonance and the "
          "axis shakes.",
      .causes =
          "Errors of the teeth and the wave generator's shape, misalignment in assembly; mostly twice a motor "
          "turn.",
      .check =
          "Turn slowly with an encoder on the output and compare with the motor's; check the alignment of circular "
          "spline and wave generator.",
      .confused_with = "load_scaled_ripple,torque_ripple,dahl_hysteresis",
      .separated_by = "slow constant speed over many turns with an output encoder",
      .adds_to = on(Balance::motor),
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order",
       .symbol = "k",
       .unit = units::kNone,
       .kind = Kind::given,
       .usual = 2.0,
       .low = 0.01,
       .high = 1000.0},
      {.name = "cosine", .unit = units::kAngle, .kind = Kind::nonlinear, .usual = 4e-5, .limit = Limit::torsion},
      {.name = "sine", .unit = units::kAngle, .kind = Kind::nonlinear, .usual = 0.0, .limit = Limit::torsion},
  };
  template <class N>
  struct Coefficients {
    typename N::Order order;
    typename N::Gain cosine;  // of the angle
    typename N::Gain sine;
    typename N::Gain rate_cosine;  // of its slope, times velocity
    typename N::Gain rate_sine;
    typename N::Weight torque_cosine;  // of its slope, times torque
    typename N::Weight torque_sine;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(order), c(cosine), c(sine), c(rate_cosine), c(rate_sine), c(torque_cosine), c(torque_sine);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P k = p[0] * d.turn_angle_scale;
    const P rate = k * d.velocity_base / d.torsion_rate_base;
    const P torque = k * d.output_torque_base / d.torque_base;
    return {N::order(k * d.angle_base), N::gain(p[1] / d.torsion_base), N::gain(p[2] / d.torsion_base),
            N::gain(p[2] * rate),       N::gain(-p[1] * rate),          N::weight(p[2] * torque),
            N::weight(-p[1] * torque)};
  }
  template <class N>
  static void shift(const Coefficients<N>& c, Inputs<N>& in) {
    const auto wave = N::sincos(N::times_order(in.angle, c.order));
    in.torsion = in.torsion + N::scaled(c.cosine, wave.cosine) + N::scaled(c.sine, wave.sine);
    in.torsion_rate = in.torsion_rate +
                      N::times(in.velocity, N::scaled(c.rate_cosine, wave.cosine) + N::scaled(c.rate_sine, wave.sine));
  }
  // Virtual work: a spring that is twisted by e(q) turns the motor with T e'(q).
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const auto wave = N::sincos(N::times_order(in.angle, c.order));
    out.motor += c.torque_cosine * N::times(in.torque, wave.cosine) + c.torque_sine * N::times(in.torque, wave.sine);
  }
};
FLEXSPLINE_EFFECT(40, KinematicError);

}  // namespace flexspline::effects
