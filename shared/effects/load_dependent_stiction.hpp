#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct LoadDependentStiction : Stateless {
  static constexpr Description kInfo{
      .name = "load_dependent_stiction",
      .reads = kMotorMotion | kDirection | kTorque,
      .equation = "mu abs(T)/N s(w) exp(-(w/vs)^2)",
      .shows_over = "torque, by direction, at low velocity",
      .source = "boundary lubrication under load; BAM's model M4",
      .explanation =
          "The friction that falls as motion gets faster (Stribeck) grows with the torque through the gear: the harder "
          "its surfaces are pressed together, the less lubricant is left between them near standstill.",
      .consequence =
          "Slow motion jerks (stick-slip) under load and is smooth without; an arm that is stretched out moves in "
          "steps.",
      .causes =
          "Boundary lubrication of tooth mesh and wave-generator bearing under load: thin, old or too little grease.",
      .check =
          "Creep at the slowest speed that is used, with the arm hanging and with it stretched out, and compare the "
          "jerks; renew the grease of the tooth mesh.",
      .confused_with = "load_dependent_friction,stribeck_gaussian,stribeck_hess_soom",
      .separated_by =
          "slow triangles of velocity in both directions at no load and at a constant external load, and a fast motion "
          "under that load",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "mu", .unit = units::kNone, .usual = 0.05, .low = 0.0, .high = 1.0},
      {.name = "velocity",
       .symbol = "vs",
       .unit = units::kVelocity,
       .kind = Kind::nonlinear,
       .usual = 3.0,
       .low = 1e-6,
       .limit = Limit::velocity},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight coefficient;
    typename N::RatioGain per_velocity;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(coefficient), c(per_velocity);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.output_torque_base / (d.gear_ratio * d.torque_base)),
            N::ratio_gain(d.velocity_base / p[1])};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value bell = N::gauss(N::ratio(c.per_velocity, in.velocity));
    out.motor += c.coefficient * N::times(N::times(in.torque_magnitude, in.direction), bell);
  }
};
FLEXSPLINE_EFFECT(47, LoadDependentStiction);

}  // namespace flexspline::effects
