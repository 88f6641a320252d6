#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TemperatureCoulomb : Stateless {
  static constexpr Description kInfo{
      .name = "temperature_coulomb",
      .phase = Phase::modulate,
      .reads = kMotorMotion | kTemperature,
      .equation = "modulates coulomb_friction: Ts (exp(-b (temp-temp0)) - 1) s(w)",
      .shows_over = "temperature",
      .source = "lubricant, preload",
      .explanation = "The friction that does not depend on speed falls as the gear warms up.",
      .consequence = "A cold axis sticks more: the first motions of a day are worse than later ones.",
      .causes = "Preload of the mesh and bearings that changes as parts expand; grease that stiffens in the cold.",
      .check =
          "Repeat a slow motion every few minutes from a cold start and plot the current over the housing's "
          "temperature.",
      .confused_with = "temperature_viscous",
      .separated_by = "slow and fast motion at two temperatures",
      .modulates = "coulomb_friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient",
       .symbol = "b",
       .unit = units::kPerKelvin,
       .kind = Kind::nonlinear,
       .usual = 0.005,
       .low = -0.02,
       .high = 0.06},
  };
  template <class N>
  struct Coefficients {
    typename N::Gain coefficient;
    typename N::Value reference;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(coefficient), c(reference);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::gain(p[0] * d.temperature_base), N::value(d.reference_temperature / d.temperature_base)};
  }
  template <class N>
  static void modulate(const Coefficients<N>& c, Inputs<N>& in) {
    in.coulomb_scale =
        N::times(in.coulomb_scale, N::exp_negative(N::scaled(c.coefficient, in.temperature - c.reference)));
  }
};
FLEXSPLINE_EFFECT(23, TemperatureCoulomb);

}  // namespace flexspline::effects
