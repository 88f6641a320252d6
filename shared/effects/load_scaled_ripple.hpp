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
          "A torque on the motor that repeats with its angle and grows with the load: what a kinematic error of "
          "the gear looks like from the motor.",
      .causes = "Kinematic error of the mesh; misalignment of the wave generator that shows under load.",
      .rivals = "kinematic_error,torque_ripple",
      .separated_by = "slow constant speed over many turns at two loads, with an output encoder",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "order", .unit = units::kNone, .kind = Kind::given, .usual = 2.0, .low = 0.01, .high = 1000.0},
      {.name = "cosine", .unit = units::kNone, .usual = 5e-4},
      {.name = "sine", .unit = units::kNone, .usual = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Order order;
    typename N::Gain cosine;
    typename N::Gain sine;
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P torque = d.output_torque_base / d.torque_base;
    return {N::order(p[0] * d.turn_angle_scale * d.angle_base), N::gain(p[1] * torque), N::gain(p[2] * torque)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const auto wave = N::sincos(N::times_order(in.angle, c.order));
    out.motor += c.cosine * N::times(in.torque, wave.cosine) + c.sine * N::times(in.torque, wave.sine);
  }
};
FLEXSPLINE_EFFECT(25, LoadScaledRipple);

}  // namespace flexspline::effects
