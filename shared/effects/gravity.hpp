#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct Gravity : Stateless {
  static constexpr Description kInfo{
      .name = "gravity",
      .balance = Balance::load,
      .reads = kOutputMotion | kOutputAngle,
      .equation = "cosine cos(qo) + sine sin(qo), which is m g l sin(qo + phi)",
      .shows_over = "output angle",
      .source = "unbalanced link",
      .explanation =
          "The link's centre of mass is off the axis, so its weight turns the output, depending on the angle.",
      .consequence = "The axis needs a holding torque that depends on the angle, and falls when the drive is off.",
      .causes = "An arm, tool or cable that is not balanced; a base that is not level.",
      .check =
          "Turn the output slowly through a turn and note the holding current; check balance weights, cables and the "
          "level of the base.",
      .confused_with = "linear_stiffness",
      .separated_by = "slow motion over a large part of an output turn",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "cosine", .unit = units::kTorque, .usual = 0.5},
      {.name = "sine", .unit = units::kTorque, .usual = 3.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight cosine;
    typename N::Weight sine;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(cosine), c(sine);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.output_torque_base), N::weight(p[1] / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const auto wave = N::sincos(in.output_angle);
    out.load += c.cosine * wave.cosine + c.sine * wave.sine;
  }
};
FLEXSPLINE_EFFECT(20, Gravity);

}  // namespace flexspline::effects
