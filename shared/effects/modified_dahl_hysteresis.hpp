#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct ModifiedDahlHysteresis {
  static constexpr Description kInfo{
      .name = "modified_dahl_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "T' = sigma v abs(1 - T/Tc s(v))^2 s(1 - T/Tc s(v))",
      .shows_over = "loop, rate independent",
      .source = "report eq. 66",
      .explanation =
          "As dahl_hysteresis with the exponent two: a steep start after each reversal and a slow approach to "
          "the limit.",
      .consequence = "The output stops at another angle when it comes from the other side, by up to the loop's width.",
      .causes = "Friction inside the flexspline, its bolted joints and the mesh.",
      .check =
          "Lock the output, raise and lower the current slowly: torque against angle draws the loop. Check the "
          "flexspline's bolts and clamping first.",
      .confused_with =
          "dahl_hysteresis,structural_damping,bouc_wen_hysteresis,duhem_hysteresis,prandtl_ishlinskii_hysteresis",
      .separated_by =
          "the same torsion amplitude at a second frequency, which leaves this loop as it is; loops of several "
          "amplitudes against other laws of hysteresis",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "torque", .symbol = "Tc", .unit = units::kTorque, .usual = 2.0, .low = 0.0},
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
    typename N::Weight torque;
    typename N::Gain per_torsion;
    typename N::Exponent exponent;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_torsion), c(exponent);
    }
  };
  // Share of the full torque, -1 to 1.
  template <class N>
  struct State {
    typename N::State carried{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.output_torque_base), N::gain(p[1] * d.torsion_base / p[0]), N::exponent(P(2.0))};
  }
  // See dahl_hysteresis: u becomes u/(1 + x u).
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Value torsion = now.torsion - before.torsion;
    const typename N::State limit = N::sign(torsion);
    const typename N::Value left = N::narrow(N::magnitude(limit - state.carried));
    const typename N::Travel travel = N::times(N::travel(c.per_torsion, N::magnitude(torsion)), left);
    state.carried = N::relax(state.carried, limit, N::q_exp_negative(travel, c.exponent));
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += c.torque * N::narrow(state.carried);
  }
};
FLEXSPLINE_EFFECT(34, ModifiedDahlHysteresis);

}  // namespace flexspline::effects
