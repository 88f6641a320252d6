#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TorqueProportionalHysteresis {
  static constexpr Description kInfo{
      .name = "torque_proportional_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "z' = sigma v (1 - s(v) z/(c0 + c1 abs(T))), the torque is z",
      .shows_over = "loop widens with load",
      .source = "measurements on strain-wave gears",
      .explanation =
          "The hysteresis of the gear grows with the torque through it: its loop is narrow about zero and wide "
          "at full load.",
      .consequence = "The output's angle under load depends on where the load came from, by a share of the load.",
      .causes = "Friction between teeth and in the wave generator, pressed together by the load.",
      .check =
          "Load and unload the locked output to half and to all of the torque and compare the width of the two loops; "
          "check lubricant and wear of the teeth.",
      .confused_with = "dahl_hysteresis,load_dependent_friction",
      .separated_by = "loops of small amplitude at no load and at half the rated torque",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "c0", .unit = units::kTorque, .usual = 0.5, .low = 0.0},
      {.name = "ratio",
       .symbol = "c1",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 0.05,
       .low = 0.0,
       .limit = Limit::inverse_torque,
       .per = "torque"},
      {.name = "stiffness",
       .symbol = "sigma",
       .unit = units::kStiffness,
       .kind = Kind::nonlinear,
       .usual = 5000.0,
       .low = 1e-9,
       .limit = Limit::inverse_torsion,
       .per = "torque"},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight most;  // bound at twice the rated torque
    typename N::Value rest;
    typename N::Gain per_torque;
    typename N::Gain per_torsion;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(most), c(rest), c(per_torque), c(per_torsion);
    }
  };
  // Share of that bound.
  template <class N>
  struct State {
    typename N::State share{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P most = p[0] + P(2.0) * p[1] * d.output_torque_base;
    return {N::weight(most / d.output_torque_base), N::value(p[0] / most),
            N::gain(P(0.5) * p[1] * d.output_torque_base / most), N::gain(p[2] * d.torsion_base / most)};
  }
  // Exact for the mean of the bounds at both ends of the step.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Value torsion = now.torsion - before.torsion;
    const typename N::Value bound = c.rest + N::scaled(c.per_torque, now.torque_magnitude + before.torque_magnitude);
    const typename N::Travel travel = N::over(N::travel(c.per_torsion, N::magnitude(torsion)), bound);
    state.share = N::relax(state.share, N::times(N::sign(torsion), bound), N::exp_negative(travel));
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += c.most * N::narrow(state.share);
  }
};
FLEXSPLINE_EFFECT(39, TorqueProportionalHysteresis);

}  // namespace flexspline::effects
