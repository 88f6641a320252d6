#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct LoadScaledRipple : Stateless {
  static constexpr Description kInfo{
      .name = "load_scaled_ripple",
      .reads = kMotorMotion | kMotorAngle | kTorque,
      .equation = "T (a cos(k q) + b sin(k q))",
      .shows_over = "motor angle times torque",
      .source = "mesh",
      .explanation =
          "A torque on the motor that repeats with its angle and grows with the load: the effect of a kinematic error "
          "of the gear on the motor.",
      .consequence = "The speed ripples under load and is smooth without.",
      .causes = "Kinematic error of the mesh; misalignment of the wave generator that shows under load.",
      .check =
          "Turn slowly at two loads and compare the ripple of the current; check the alignment of the wave generator.",
      .confused_with = "kinematic_error,torque_ripple",
      .separated_by = "slow constant speed over many turns at two loads, with an output encoder",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order",
       .symbol = "k",
       .unit = units::kNone,
       .kind = Kind::given,
       .usual = 2.0,
       .low = 0.01,
       .high = 1000.0},
      {.name = "cosine", .symbol = "a", .unit = units::kNone, .usual = 5e-4},
      {.name = "sine", .symbol = "b", .unit = units::kNone, .usual = 0.0},
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
    const P torque = d.output_torque_base / d.torque_base;
    return {N::harmonic(p[0] * d.turn_angle_scale * d.angle_base, p[1] * torque, p[2] * torque)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += N::wave_times(c.ripple, in.angle, in.torque);
  }
};
FLEXSPLINE_EFFECT(25, LoadScaledRipple);

}  // namespace flexspline::effects
