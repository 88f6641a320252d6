#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct AngleDependentFriction : Stateless {
  static constexpr Description kInfo{
      .name = "angle_dependent_friction",
      .reads = kMotorMotion | kDirection | kMotorAngle | kBothDirections,
      .equation = "s(w) (a cos(k q) + b sin(k q))",
      .shows_over = "motor angle, by direction",
      .source = "Armstrong-Helouvry, friction over position",
      .explanation =
          "Friction is higher at some angles than at others, k times a turn of the motor; once a turn of the output is "
          "the order 1/N. Unlike a ripple of torque it always resists: its sign follows the direction of motion.",
      .consequence =
          "The torque of slow motion swings with the angle, in both directions about its own mean; the axis stops at "
          "some angles more easily than at others.",
      .causes =
          "A shaft, bearing or seal that is out of round or out of line, uneven preload or wear of the teeth, a cable "
          "that drags in a part of the output's turn. At twice the motor's pole pairs also current sensors whose gains "
          "differ: what varies then is the current that is logged, not the friction.",
      .check =
          "Turn slowly over several turns forward and then backward: half the difference of the two currents over the "
          "angle is friction, half their sum is ripple. Look at the angle of the maximum for rubbing, runout and wear.",
      .confused_with = "torque_ripple,kinematic_error,load_scaled_ripple,coulomb_friction",
      .separated_by = "slow constant speed over several turns of the motor, or of the output, in both directions",
      .phase_error_of = "torque_ripple,load_scaled_ripple,kinematic_error",
  };
  // An order of 1/N is one a turn of the output.
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order",
       .symbol = "k",
       .unit = units::kNone,
       .kind = Kind::given,
       .usual = 2.0,
       .low = 0.001,
       .high = 1000.0},
      {.name = "cosine", .symbol = "a", .unit = units::kTorque, .usual = 0.006},
      {.name = "sine", .symbol = "b", .unit = units::kTorque, .usual = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Harmonic friction;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(friction);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::harmonic(p[0] * d.turn_angle_scale * d.angle_base, p[1] / d.torque_base, p[2] / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += N::wave_times(c.friction, in.angle, in.direction);
  }
};
FLEXSPLINE_EFFECT(46, AngleDependentFriction);

}  // namespace flexspline::effects
