#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct LugreFriction {
  static constexpr Description kInfo{
      .name = "lugre_friction",
      .reads = kMotorMotion | kDirection | kMotorAngle,
      .equation =
          "replaces coulomb_friction, stribeck: s0 z + s1 z', z' = w - s0 abs(w) z/g, g = Fc + (Fs-Fc) "
          "exp(-(w/vs)^2)",
      .shows_over = "travel since reversal",
      .source = "Canudas de Wit",
      .explanation =
          "The contacts bend like bristles before they slide (presliding), and slide with a friction that is "
          "higher near standstill than in motion.",
      .consequence =
          "The axis springs within its stiction, breaks loose and jerks at slow speed; it oscillates about a position.",
      .causes = "Elastic contacts in mesh, bearings and seals together with boundary lubrication.",
      .check = "Creep at the slowest speed that is used and look for stick-slip; check grease and preload.",
      .confused_with = "dahl_friction,stribeck_gaussian,stribeck_hess_soom,coulomb_friction",
      .separated_by = "small slow motion that reverses often, and a slow free triangle of velocity",
      .replaces = "coulomb_friction,stribeck_gaussian,stribeck_hess_soom",
      .surface = "dry friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coulomb", .symbol = "Fc", .unit = units::kTorque, .usual = 0.045, .low = 0.0},
      {.name = "static",
       .symbol = "Fs",
       .unit = units::kTorque,
       .kind = Kind::nonlinear,
       .usual = 0.055,
       .low = 1.0,
       .high = 3.0,
       .per = "coulomb"},
      {.name = "velocity",
       .symbol = "vs",
       .unit = units::kVelocity,
       .kind = Kind::nonlinear,
       .usual = 3.0,
       .low = 1e-6,
       .limit = Limit::velocity},
      {.name = "stiffness",
       .symbol = "s0",
       .unit = units::kStiffness,
       .kind = Kind::nonlinear,
       .usual = 0.4,
       .low = 1e-9,
       .limit = Limit::inverse_travel,
       .per = "coulomb"},
      {.name = "damping",
       .symbol = "s1",
       .unit = units::kViscous,
       .kind = Kind::nonlinear,
       .usual = 1e-4,
       .low = 0.0,
       .limit = Limit::inverse_velocity,
       .per = "coulomb"},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight full;  // static friction, the largest load of the bristles
    typename N::Weight damping;
    typename N::Value sliding;  // Fc/Fs
    typename N::Gain rise;      // 1 - Fc/Fs
    typename N::RatioGain per_velocity;
    typename N::StepGain per_travel;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(full), c(damping), c(sliding), c(rise), c(per_velocity), c(per_travel);
    }
  };
  // Share of the static friction that the bristles carry.
  template <class N>
  struct State {
    typename N::State deflection{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P sliding = p[0] / p[1];
    return {N::weight(p[1] / d.torque_base),
            N::weight(p[4] * d.velocity_base / d.torque_base),
            N::value(sliding),
            N::gain(P(1.0) - sliding),
            N::ratio_gain(d.velocity_base / p[2]),
            N::step_gain(p[3] * d.angle_base / p[1])};
  }
  // g over the static friction.
  template <class N>
  static typename N::Value limit(const Coefficients<N>& c, const Inputs<N>& in) {
    return c.sliding + N::scaled(c.rise, N::gauss(N::ratio(c.per_velocity, in.velocity)));
  }
  // Over a step the speed hardly changes, so g is taken as constant and the law is linear in z: it is solved exactly
  // over travel, as s0 is far too stiff for an explicit step.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Step travel = now.angle - before.angle;
    const typename N::Value most = limit(c, now);
    const auto share = N::exp_negative(N::over(N::travel(c.per_travel, N::magnitude(travel)), most));
    state.deflection = N::relax(state.deflection, N::times(N::sign(travel), most), share);
  }
  // s1 z' = s1 w (1 - s(w) s0 z/g): zero in steady sliding.
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value carried = N::narrow(state.deflection);
    const typename N::Value slack = N::one() - N::times(in.direction, N::times(carried, N::reciprocal(limit(c, in))));
    out.motor += c.full * N::times(carried, in.coulomb_scale) + c.damping * N::times(in.velocity, slack);
  }
};
FLEXSPLINE_EFFECT(24, LugreFriction);

}  // namespace flexspline::effects
