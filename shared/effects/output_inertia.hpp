#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct OutputInertia : Stateless {
  static constexpr Description kInfo{
      .name = "output_inertia",
      .balance = Balance::load,
      .reads = kOutputMotion,
      .equation = "Jo ao",
      .shows_over = "acceleration",
      .source = "report eq. 45",
      .explanation = "The link and its payload resist every change of speed.",
      .consequence = "Sets the resonance with the gear's stiffness: a heavier link swings slower and longer.",
      .causes = "Always there. A change means another payload.",
      .check = "Weigh the payload, or compute it from the drawings; ask what was mounted since the last recording.",
      .confused_with = "inertia",
      .separated_by = "a torque sensor, or a second known payload",
      .runs_always = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "inertia", .symbol = "Jo", .unit = units::kInertia, .usual = 0.06, .low = 0.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight inertia;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(inertia);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.output_acceleration_base / d.output_torque_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.load += c.inertia * in.output_acceleration;
  }
};
FLEXSPLINE_EFFECT(17, OutputInertia);

}  // namespace flexspline::effects
