#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct PiecewiseStiffness : Stateless {
  static constexpr Description kInfo{
      .name = "piecewise_stiffness",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "replaces linear_stiffness: slopes K1, K2, K3 with corners at torques T1, T2",
      .shows_over = "torsion, corners",
      .source = "makers' catalogues",
      .explanation =
          "The spring has three slopes, as catalogues of gears state them: soft up to a torque T1, harder up to T2, "
          "hardest beyond.",
      .consequence = "The resonance jumps with the load's range; a model with one stiffness is too soft or too stiff.",
      .causes = "Teeth that come into mesh one after the other as the load grows.",
      .check =
          "Compare the corners and slopes with the three that the maker's catalogue states for this size and ratio.",
      .confused_with = "cubic_stiffness,backlash",
      .separated_by = "slow sine of torque up to twice T2 in locked load",
      .replaces = "linear_stiffness",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "stiffness_1", .symbol = "K1", .unit = units::kStiffness, .usual = 4725.0, .low = 0.0},
      {.name = "stiffness_2",
       .symbol = "K2",
       .unit = units::kStiffness,
       .kind = Kind::nonlinear,
       .usual = 6300.0,
       .low = 0.5,
       .high = 5.0,
       .per = "stiffness_1"},
      {.name = "stiffness_3",
       .symbol = "K3",
       .unit = units::kStiffness,
       .kind = Kind::nonlinear,
       .usual = 7875.0,
       .low = 0.5,
       .high = 8.0,
       .per = "stiffness_1"},
      {.name = "torque_1",
       .symbol = "T1",
       .unit = units::kTorque,
       .kind = Kind::nonlinear,
       .usual = 3.0,
       .low = 1e-12,
       .limit = Limit::corner,
       .per = "stiffness_1"},
      {.name = "torque_2",
       .symbol = "T2",
       .unit = units::kTorque,
       .kind = Kind::nonlinear,
       .usual = 7.0,
       .low = 1.0,
       .high = 20.0,
       .per = "torque_1"},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight inner;
    typename N::Weight middle;
    typename N::Weight outer;
    typename N::Value first;  // torsion at the corners
    typename N::Value second;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(inner), c(middle), c(outer), c(first), c(second);
    }
  };
  // T1/K1, and from there (T2 - T1)/K2 on.
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P scale = d.torsion_base / d.output_torque_base;
    const P first = p[3] / p[0];
    const P second = first + (p[4] - p[3]) / p[1];
    return {N::weight(p[0] * scale), N::weight(p[1] * scale), N::weight(p[2] * scale), N::value(first / d.torsion_base),
            N::value(second / d.torsion_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const typename N::Value inner = N::clamp(in.torsion, c.first);
    const typename N::Value middle = N::clamp(in.torsion, c.second);
    out.transmission += c.inner * inner + c.middle * (middle - inner) + c.outer * (in.torsion - middle);
  }
};
FLEXSPLINE_EFFECT(32, PiecewiseStiffness);

}  // namespace flexspline::effects
