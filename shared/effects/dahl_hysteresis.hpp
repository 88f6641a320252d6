#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct DahlHysteresis {
  static constexpr Description kInfo{
      .name = "dahl_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "T' = sigma v abs(1 - T/Tc s(v))^i s(1 - T/Tc s(v))",
      .shows_over = "loop, rate independent",
      .source = "Dahl; report eq. 65",
      .explanation =
          "Twisting back and forth loses the same energy however slowly it is done: part of the torque depends on "
          "where the motion last reversed, not on the torsion alone.",
      .consequence =
          "The output stops at another angle when it comes from the other side, by up to the loop's width, however "
          "slow the motion is.",
      .causes = "Friction inside the flexspline, its bolted joints and the mesh.",
      .check =
          "Lock the output, raise and lower the current slowly: torque against angle draws the loop. Check the "
          "flexspline's bolts and clamping first.",
      .confused_with =
          "structural_damping,modified_dahl_hysteresis,bouc_wen_hysteresis,duhem_hysteresis,prandtl_ishlinskii_"
          "hysteresis",
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
      {.name = "exponent",
       .symbol = "i",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 1.0,
       .low = 0.5,
       .high = 4.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::Gain per_torsion;
    typename N::Exponent exponent;
    typename N::Exponent less_one;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_torsion), c(exponent), c(less_one);
    }
  };
  // Share of the full torque, -1 to 1.
  template <class N>
  struct State {
    typename N::State carried{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] / d.output_torque_base), N::gain(p[1] * d.torsion_base / p[0]), N::exponent(p[2]),
            N::exponent(p[2] - P(1.0))};
  }
  // The distance to the limit, u = abs(s - T/Tc), obeys u' = -u^i over travel x = sigma abs(dq)/Tc, whose solution is
  // u0 times the q-exponential of x u0^(i-1). Where i < 1 that power grows without bound as the limit comes near, which
  // is then reached after a finite travel.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Value torsion = now.torsion - before.torsion;
    const typename N::State limit = N::sign(torsion);
    const typename N::State left = N::magnitude(limit - state.carried);
    const typename N::Travel travel = N::times_power(N::travel(c.per_torsion, N::magnitude(torsion)), left, c.less_one);
    state.carried = N::relax(state.carried, limit, N::q_exp_negative(travel, c.exponent));
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += c.torque * N::narrow(state.carried);
  }
};
FLEXSPLINE_EFFECT(33, DahlHysteresis);

}  // namespace flexspline::effects
