#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct BoucWenHysteresis {
  static constexpr Description kInfo{
      .name = "bouc_wen_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "kz z, z' = v - beta abs(v) abs(z)^(n-1) z - gamma v abs(z)^n",
      .shows_over = "loop, rate independent",
      .source = "Bouc, Wen",
      .explanation =
          "A hysteresis with a shape that can be tuned: how abruptly it yields (n) and how its loop leans "
          "(gamma over beta).",
      .consequence =
          "The output stops at another angle when it comes from the other side, and vibration dies out sooner than a "
          "spring would let it.",
      .causes = "Friction inside the flexspline, its bolted joints and the mesh.",
      .check =
          "Load and unload the locked output slowly by hand: the angle that stays at zero torque is the loop's width. "
          "Check the flexspline's bolts first.",
      .confused_with =
          "dahl_hysteresis,modified_dahl_hysteresis,duhem_hysteresis,structural_damping,prandtl_ishlinskii_hysteresis",
      .separated_by =
          "the same torsion amplitude at a second frequency, which leaves this loop as it is; loops of several "
          "amplitudes against other laws of hysteresis",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "stiffness", .symbol = "kz", .unit = units::kStiffness, .usual = 5000.0, .low = 0.0},
      {.name = "beta",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 2500.0,
       .low = 1e-9,
       .limit = Limit::inverse_torsion,
       .root_of = "exponent"},
      {.name = "gamma",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 0.0,
       .low = -0.5,
       .high = 1.0,
       .per = "beta"},
      {.name = "exponent",
       .symbol = "n",
       .unit = units::kNone,
       .kind = Kind::nonlinear,
       .usual = 1.0,
       .low = 1.0,
       .high = 3.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;  // at full yield
    typename N::Gain per_torsion;
    typename N::Value unloading;  // (gamma - beta)/(gamma + beta)
    typename N::Gain stiffening;  // n
    typename N::Exponent exponent;
    typename N::Exponent less_one;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_torsion), c(unloading), c(stiffening), c(exponent), c(less_one);
    }
  };
  // z over its largest value, (beta + gamma)^(-1/n).
  template <class N>
  struct State {
    typename N::State share{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P most = N::power(p[1] + p[2], P(-1.0) / p[3]);
    return {N::weight(p[0] * most / d.output_torque_base),
            N::gain(d.torsion_base / most),
            N::value((p[2] - p[1]) / (p[2] + p[1])),
            N::gain(p[3]),
            N::exponent(p[3]),
            N::exponent(p[3] - P(1.0))};
  }
  // The share obeys y' = 1 - k abs(y)^n along the motion, k = 1 where it grows and the coefficient `unloading` where it
  // falls: linearised about the state and then solved exactly (exponential Rosenbrock step, second order), exact for
  // n = 1 and gamma = 0; an explicit step would overshoot in fast motion.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Value torsion = now.torsion - before.torsion;
    const typename N::Value along = N::narrow(N::sign(torsion));
    const typename N::Value share = N::narrow(state.share);
    const typename N::Travel travel = N::travel(c.per_torsion, N::magnitude(torsion));
    const typename N::Value k = N::by_sign(N::times(along, share), N::one(), c.unloading);
    const typename N::Value slope = N::one() - N::times(k, N::pow_abs(state.share, c.exponent));
    const typename N::Value bend =
        N::scaled(c.stiffening, N::times(N::magnitude(k), N::pow_abs(state.share, c.less_one)));
    const typename N::Value mean = N::times(slope, N::exp_mean(N::times(travel, bend)));
    state.share = N::clamp_to_one(state.share + N::times(N::step(travel, mean), along));
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += c.torque * N::narrow(state.share);
  }
};
FLEXSPLINE_EFFECT(36, BoucWenHysteresis);

}  // namespace flexspline::effects
