#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct TemperatureViscous : Stateless {
  static constexpr Description kInfo{
      .name = "temperature_viscous",
      .phase = Phase::modulate,
      .reads = kMotorMotion | kTemperature,
      .equation = "modulates viscous_friction: Tv (exp(-b (temp-temp0)) - 1) w",
      .shows_over = "temperature, between runs",
      .source = "lubricant",
      .explanation = "Warm lubricant is thinner: viscous friction falls as the gear warms up.",
      .consequence = "A cold axis needs more torque at speed and may miss its top speed after a cold start.",
      .causes = "Always there to some extent; seen where records were taken cold and warm.",
      .check =
          "Repeat a fast motion every few minutes from a cold start and plot the current over the housing's "
          "temperature; check the grease's range.",
      .confused_with = "temperature_coulomb",
      .separated_by = "slow and fast motion at two temperatures",
      .modulates = "viscous_friction",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient",
       .symbol = "b",
       .unit = units::kPerKelvin,
       .kind = Kind::nonlinear,
       .usual = 0.012,
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
    in.viscous_scale =
        N::times(in.viscous_scale, N::exp_negative(N::scaled(c.coefficient, in.temperature - c.reference)));
  }
};
FLEXSPLINE_EFFECT(9, TemperatureViscous);

}  // namespace flexspline::effects
