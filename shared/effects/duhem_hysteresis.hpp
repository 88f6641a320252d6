#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct DuhemHysteresis {
  static constexpr Description kInfo{
      .name = "duhem_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation =
          "replaces stiffness and damping: T' = a abs(v) (phi(dq) - T) + b v, phi(x) = phi_0 + phi_1 x + phi_2 "
          "x^2 + phi_3 x^3",
      .shows_over = "loop, rate independent",
      .source = "Duhem; report eq. 67, with phi of the torsion",
      .explanation =
          "One law for spring and loop together: the torque follows a slope b and is drawn towards a curve phi "
          "of the torsion.",
      .consequence =
          "The output stops at another angle when it comes from the other side, and the stiffness seen depends on what "
          "came before.",
      .causes = "Friction inside the flexspline and the mesh, described together with the stiffness.",
      .check = "Lock the output and make slow loops of several sizes; check the flexspline's bolts and clamping first.",
      .confused_with = "dahl_hysteresis,bouc_wen_hysteresis,structural_damping,prandtl_ishlinskii_hysteresis",
      .separated_by =
          "the same torsion amplitude at a second frequency, which leaves this loop as it is; loops of several "
          "amplitudes against other laws of hysteresis",
      .replaces = "linear_stiffness,cubic_stiffness,quadratic_stiffness,piecewise_stiffness,structural_damping",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "rate",
       .symbol = "a",
       .unit = units::kPerAngle,
       .kind = Kind::nonlinear,
       .usual = 2500.0,
       .low = 1e-9,
       .limit = Limit::inverse_torsion},
      {.name = "stiffness", .symbol = "b", .unit = units::kStiffness, .usual = 11300.0},
      {.name = "phi_0", .unit = units::kTorque, .usual = 0.0},
      {.name = "phi_1", .unit = units::kStiffness, .usual = 6300.0},
      {.name = "phi_2", .unit = {"N*m/rad^2", "N/m^2"}, .usual = 0.0},
      {.name = "phi_3", .unit = {"N*m/rad^3", "N/m^3"}, .usual = 3e8},
  };
  template <class N>
  struct Coefficients {
    typename N::Gain rate;
    typename N::Value lead;  // quarter of b/a, by which the torque leads phi in long motion
    typename N::Value eighth_phi_0;
    typename N::Gain eighth_phi_1;
    typename N::Gain eighth_phi_2;
    typename N::Gain eighth_phi_3;
    typename N::Weight torque;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(rate), c(lead), c(eighth_phi_0), c(eighth_phi_1), c(eighth_phi_2), c(eighth_phi_3), c(torque);
    }
  };
  // A quarter of the torque, in output torque bases: a drive relaxes over distances below eight.
  template <class N>
  struct State {
    typename N::State torque{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P eighth(0.125), quarter(0.25);
    const P one = d.torsion_base / d.output_torque_base;
    const P two = one * d.torsion_base;
    const P three = two * d.torsion_base;
    return {N::gain(p[0] * d.torsion_base),
            N::value(quarter * p[1] / (p[0] * d.output_torque_base)),
            N::value(eighth * p[2] / d.output_torque_base),
            N::gain(eighth * p[3] * one),
            N::gain(eighth * p[4] * two),
            N::gain(eighth * p[5] * three),
            N::weight(P(4.0))};
  }
  template <class N>
  static typename N::Value eighth_phi(const Coefficients<N>& c, typename N::Value x) {
    const typename N::Value square = N::times(x, x);
    return c.eighth_phi_0 + N::scaled(c.eighth_phi_1, x) + N::scaled(c.eighth_phi_2, square) +
           N::scaled(c.eighth_phi_3, N::times(square, x));
  }
  // Exact for the phi in the middle of the step: T' = -a abs(v) (T - phi) + b v relaxes to phi + s(v) b/a.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Value torsion = now.torsion - before.torsion;
    const typename N::Travel travel = N::travel(c.rate, N::magnitude(torsion));
    const typename N::Value phi = eighth_phi(c, now.torsion) + eighth_phi(c, before.torsion);
    const typename N::State target = N::widen(phi) + N::times(N::sign(torsion), c.lead);
    state.torque = N::relax(state.torque, target, N::exp_negative(travel));
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.transmission += c.torque * N::narrow(state.torque);
  }
};
FLEXSPLINE_EFFECT(35, DuhemHysteresis);

}  // namespace flexspline::effects
