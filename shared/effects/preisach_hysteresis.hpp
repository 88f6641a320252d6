#pragma once
#include <type_traits>

#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct PreisachHysteresis {
  static constexpr Description kInfo{
      .name = "preisach_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "sum over j >= k of weight_jk times a relay that goes up at level j and down at level k of dq",
      .shows_over = "loops within loops",
      .source = "Preisach",
      .explanation =
          "The loop as a sum of relays with two thresholds each: the most general of the rate-independent laws here, "
          "with the most parameters. Together with a stiffness its weights are negative. For analysis on the host.",
      .consequence = "The output stops at angles that depend on all reversals before, in loops within loops.",
      .causes = "Friction inside the flexspline and the mesh, of many contacts that slip one after the other.",
      .check =
          "Lock the output and superpose small sines on a slow large one; check the flexspline's bolts and clamping "
          "first.",
      .confused_with = "prandtl_ishlinskii_hysteresis,dahl_hysteresis,bouc_wen_hysteresis,duhem_hysteresis",
      .separated_by = "sines of several amplitudes superposed on a slower one, away from zero",
      .contains = "linear_stiffness",
      .host_only = true,
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "span",
       .unit = units::kAngle,
       .kind = Kind::nonlinear,
       .usual = 1.6e-3,
       .low = 1e-12,
       .limit = Limit::span},
      {.name = "weight_11", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_21", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_22", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_31", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_32", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_33", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_41", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_42", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_43", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_44", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_51", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_52", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_53", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_54", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_55", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_61", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_62", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_63", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_64", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_65", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_66", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_71", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_72", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_73", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_74", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_75", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_76", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_77", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_81", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_82", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_83", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_84", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_85", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_86", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_87", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_88", .unit = units::kTorque, .usual = -0.06},
      {.name = "weight_91", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_92", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_93", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_94", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_95", .unit = units::kTorque, .usual = -0.01},
      {.name = "weight_96", .unit = units::kTorque, .usual = -0.05},
      {.name = "weight_97", .unit = units::kTorque, .usual = -0.08},
      {.name = "weight_98", .unit = units::kTorque, .usual = -0.1},
      {.name = "weight_99", .unit = units::kTorque, .usual = -0.06},
  };
  static constexpr int kLevels = 9;
  static constexpr int kRelays = kLevels * (kLevels + 1) / 2;
  template <class N>
  struct Coefficients {
    typename N::Value up[kLevels];  // centres of the edges
    typename N::Value down[kLevels];
    typename N::Gain per_edge;
    typename N::Value initial[kRelays];  // of a gear that was cycled until its history has no influence
    typename N::Weight weight[kRelays];
    // Relays with a weight, in order: a regression evaluates one at a time, which is a small part of the work.
    unsigned char level_up[kRelays];
    unsigned char level_down[kRelays];
    unsigned char relay[kRelays];
    int used = 0;
  };
  // The difference of each relay from its initial state.
  template <class N>
  struct State {
    typename N::Value moved[kRelays]{};
  };
  // Levels (2 m - 10)/9 of the span, m = 1 to 9, each a ninth of the span higher for going up and lower for going down.
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    Coefficients<N> c;
    const P edge = p[0] / P(1.0 * kLevels);
    for (int m = 0; m < kLevels; ++m) {
      c.up[m] = N::value(edge * P(2.0 * m - 7.0) / d.torsion_base);
      c.down[m] = N::value(edge * P(2.0 * m - 9.0) / d.torsion_base);
    }
    c.per_edge = N::gain(d.torsion_base / edge);
    int at = 0;
    for (int j = 1; j <= kLevels; ++j)
      for (int k = 1; k <= j; ++k, ++at) {
        c.weight[at] = N::weight(p[1 + at] / d.output_torque_base);
        c.initial[at] = N::value(P(j + k > 10 ? -1.0 : j + k < 10 ? 1.0 : 0.0));
        if constexpr (std::is_same_v<P, double>) {
          if (p[1 + at] == 0.0) continue;
        }
        c.level_up[c.used] = static_cast<unsigned char>(j - 1);
        c.level_down[c.used] = static_cast<unsigned char>(k - 1);
        c.relay[c.used++] = static_cast<unsigned char>(at);
      }
    return c;
  }
  // A relay switches along an edge that is as wide as the distance of two levels, as a finer grid of relays would. So
  // the sum has no steps where the gear has none.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>&) {
    typename N::Value up[kLevels];
    typename N::Value down[kLevels];
    const bool few = c.used < kLevels;
    for (int m = 0; m < kLevels && !few; ++m) {
      up[m] = N::clamp(N::scaled(c.per_edge, now.torsion - c.up[m]), N::one());
      down[m] = N::clamp(N::scaled(c.per_edge, now.torsion - c.down[m]), N::one());
    }
    for (int i = 0; i < c.used; ++i) {
      const int j = c.level_up[i], k = c.level_down[i], at = c.relay[i];
      if (few) {
        up[j] = N::clamp(N::scaled(c.per_edge, now.torsion - c.up[j]), N::one());
        down[k] = N::clamp(N::scaled(c.per_edge, now.torsion - c.down[k]), N::one());
      }
      state.moved[at] = N::between(state.moved[at] + c.initial[at], up[j], down[k]) - c.initial[at];
    }
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    for (int i = 0; i < c.used; ++i) {
      const int at = c.relay[i];
      out.transmission += c.weight[at] * (state.moved[at] + c.initial[at]);
    }
  }
};
FLEXSPLINE_EFFECT(38, PreisachHysteresis);

}  // namespace flexspline::effects
