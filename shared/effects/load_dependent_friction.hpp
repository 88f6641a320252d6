#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct LoadDependentFriction : Stateless {
  static constexpr Description kInfo{
      .name = "load_dependent_friction",
      .reads = kMotorMotion | kDirection | kTorque,
      .equation = "mu abs(T)/N s(w)",
      .shows_over = "torque, by direction",
      .source = "mesh friction, efficiency",
      .explanation =
          "The harder the gear is loaded, the harder its teeth and bearings press together, and the more they "
          "rub.",
      .consequence =
          "Efficiency falls: lifting takes more and lowering less torque than the load alone; control gets sluggish "
          "under load.",
      .causes = "Tooth mesh and wave-generator bearing under load: the gear's efficiency. Seen only where load varies.",
      .check =
          "Lift and lower the same weight at the same speed and compare the currents; check the lubricant of the tooth "
          "mesh and the wear of the teeth.",
      .confused_with = "stribeck_gaussian,torque_constant_saturation",
      .separated_by =
          "a constant external load in both directions at low current; a slow free triangle against Stribeck",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "coefficient", .symbol = "mu", .unit = units::kNone, .usual = 0.03, .low = 0.0, .high = 1.0},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight coefficient;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(coefficient);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(p[0] * d.output_torque_base / (d.gear_ratio * d.torque_base))};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.coefficient * N::times(in.torque_magnitude, in.direction);
  }
};
FLEXSPLINE_EFFECT(8, LoadDependentFriction);

}  // namespace flexspline::effects
