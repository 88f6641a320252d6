#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueRipple : Stateless {
  static constexpr Description kInfo{
      .name = "torque_ripple",
      .reads = kMotorMotion | kMotorAngle,
      .equation = "a cos(k q) + b sin(k q)",
      .shows_over = "motor angle, order spectrum",
      .source = "report 5.3",
      .explanation = "A torque that repeats with the motor's angle, k times a turn.",
      .consequence =
          "The speed ripples at a multiple of the motor's speed, and where that meets the resonance the axis shakes.",
      .causes =
          "Twice a turn: the wave generator's two lobes and their misalignment. Once: an eccentric coupling or rotor. "
          "Higher orders: cogging (slots and poles), bearing balls; on a screw, its pitch.",
      .check =
          "Turn slowly at constant speed and look at the current over the angle; release the coupling and repeat to "
          "distinguish motor and gear; check concentricity.",
      .confused_with = "kinematic_error,load_scaled_ripple",
      .separated_by = "slow constant speed over many turns, then the same at a second load",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order",
       .symbol = "k",
       .unit = units::kNone,
       .kind = Kind::given,
       .usual = 2.0,
       .low = 0.01,
       .high = 1000.0},
      {.name = "cosine", .symbol = "a", .unit = units::kTorque, .usual = 0.004},
      {.name = "sine", .symbol = "b", .unit = units::kTorque, .usual = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Harmonic ripple;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(ripple);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::harmonic(p[0] * d.turn_angle_scale * d.angle_base, p[1] / d.torque_base, p[2] / d.torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += N::wave(c.ripple, in.angle);
  }
};
FLEXSPLINE_EFFECT(11, TorqueRipple);

}  // namespace flexspline::effects
