#pragma once
#include <array>

#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct PrandtlIshlinskiiHysteresis {
  static constexpr Description kInfo{
      .name = "prandtl_ishlinskii_hysteresis",
      .balance = Balance::transmission,
      .reads = kTorsion | kTorque,
      .equation = "sum over j of weight_j times a play of half-width threshold_j that dq drives",
      .shows_over = "loops within loops",
      .source = "Ishlinskii",
      .explanation =
          "The loop as a sum of plays of different widths: any loop whose shape does not depend on its place along the "
          "torsion, with loops within loops. Together with a stiffness its weights are negative.",
      .consequence = "The output stops at angles that depend on all reversals before; small motions have small loops.",
      .causes = "Friction inside the flexspline and the mesh, of many contacts that slip one after the other.",
      .check =
          "Lock the output and superpose small sines on a slow large one; check the flexspline's bolts and clamping "
          "first.",
      .confused_with = "dahl_hysteresis,bouc_wen_hysteresis,duhem_hysteresis,preisach_hysteresis",
      .separated_by = "sines of several amplitudes superposed on a slower one",
      .contains = "linear_stiffness",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "threshold_1",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 4e-05,
       .low = 0.0,
       .share_of_range = 0.02},
      {.name = "threshold_2",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.0001,
       .low = 0.0,
       .share_of_range = 0.05},
      {.name = "threshold_3",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.0002,
       .low = 0.0,
       .share_of_range = 0.1},
      {.name = "threshold_4",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.00036,
       .low = 0.0,
       .share_of_range = 0.18},
      {.name = "threshold_5",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.0006,
       .low = 0.0,
       .share_of_range = 0.3},
      {.name = "threshold_6",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.0009,
       .low = 0.0,
       .share_of_range = 0.45},
      {.name = "threshold_7",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.00126,
       .low = 0.0,
       .share_of_range = 0.63},
      {.name = "threshold_8",
       .unit = units::kAngle,
       .kind = Kind::grid,
       .usual = 0.0017,
       .low = 0.0,
       .share_of_range = 0.85},
      {.name = "weight_1", .unit = units::kStiffness, .usual = -500},
      {.name = "weight_2", .unit = units::kStiffness, .usual = -500},
      {.name = "weight_3", .unit = units::kStiffness, .usual = -700},
      {.name = "weight_4", .unit = units::kStiffness, .usual = -700},
      {.name = "weight_5", .unit = units::kStiffness, .usual = -600},
      {.name = "weight_6", .unit = units::kStiffness, .usual = -400},
      {.name = "weight_7", .unit = units::kStiffness, .usual = -200},
      {.name = "weight_8", .unit = units::kStiffness, .usual = -100},
  };
  static constexpr int kPlays = 8;
  template <class N>
  struct Coefficients {
    std::array<typename N::Value, kPlays> threshold;
    std::array<typename N::Weight, kPlays> weight;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(threshold), c(weight);
    }
  };
  template <class N>
  struct State {
    typename N::Value play[kPlays]{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    Coefficients<N> c;
    for (int j = 0; j < kPlays; ++j) {
      c.threshold[j] = N::value(p[j] / d.torsion_base);
      c.weight[j] = N::weight(p[kPlays + j] * d.torsion_base / d.output_torque_base);
    }
    return c;
  }
  // A play follows the torsion itself, so that errors cannot accumulate to a drift.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>&) {
    for (int j = 0; j < kPlays; ++j)
      state.play[j] = N::between(state.play[j], now.torsion - c.threshold[j], now.torsion + c.threshold[j]);
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    for (int j = 0; j < kPlays; ++j) out.transmission += c.weight[j] * state.play[j];
  }
};
FLEXSPLINE_EFFECT(37, PrandtlIshlinskiiHysteresis);

}  // namespace flexspline::effects
