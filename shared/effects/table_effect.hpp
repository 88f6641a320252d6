#pragma once
#include <array>

#include "shared/effects/effect.hpp"
#include "shared/effects/variables.hpp"

namespace flexspline::effects {

// A piecewise linear torque: values at even steps of one signal, constant beyond both ends. The model file states its
// signal, balance and values; it has one entry for each table.
struct TableEffect : Stateless {
  static constexpr int kMostPoints = 256;
  static constexpr int kStated = 6;  // parameters before the values

  static constexpr Description kInfo{
      .name = "table_effect",
      .reads = kMotorMotion | kMotorAngle | kOutputMotion | kOutputAngle | kTorsion | kTorque | kCurrent | kTemperature,
      .equation = "f(x), f piecewise linear between points, x one signal; optionally f(x) s(w)",
      .shows_over = "the signal that it runs over",
      .source = "the data themselves",
      .explanation =
          "An effect that no formula of the catalogue describes, as a curve over one signal: up to 256 points, "
          "estimated from the residual with the smoothness that the data support, with a standard error at each point.",
      .causes =
          "A worn or damaged tooth, an uneven bearing, a brake or seal that rubs, cogging, a calibration that was made "
          "by points. The curve shows where the effect is, not its cause.",
      .confused_with = "expression_effect",
      .separated_by =
          "slow motion over the whole range of the signal, in both directions, and once more at another load",
      .adds_to = on(Balance::transmission) | on(Balance::load),
      .user_defined = true,
  };
  // Numbers of the variable and the balance; the direction zero or one; the signal at the first and at the last
  // point (not used for angles, whose points divide a turn); then the values, on the balance's own side.
  static constexpr auto kParameters = [] {
    std::array<ParameterInfo, kStated + kMostPoints> infos{};
    infos[0] = {.name = "variable", .unit = units::kNone, .kind = Kind::given, .usual = 0.0};
    infos[1] = {.name = "balance", .unit = units::kNone, .kind = Kind::given, .usual = 0.0};
    infos[2] = {.name = "times_direction", .unit = units::kNone, .kind = Kind::given, .usual = 0.0};
    infos[3] = {.name = "points", .unit = units::kNone, .kind = Kind::given, .usual = 16.0, .low = 2.0, .high = 256.0};
    infos[4] = {.name = "from", .unit = units::kNone, .kind = Kind::given, .usual = -200.0};
    infos[5] = {.name = "to", .unit = units::kNone, .kind = Kind::given, .usual = 200.0};
    for (int k = 0; k < kMostPoints; ++k)
      infos[kStated + k] = {.name = "value", .unit = units::kTorque, .kind = Kind::grid, .usual = 0.01};
    return infos;
  }();
  template <class N>
  struct Coefficients {
    Variable variable{};
    Balance balance{};
    bool times_direction = false;
    bool periodic = false;
    typename N::Value from{};
    typename N::RatioGain per_step{};  // steps per unit of the signal
    typename N::Order turn{};
    std::int16_t points = 0;
    std::array<typename N::Value, kMostPoints> value{};  // the first `points` of them
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(variable), c(balance), c(times_direction), c(periodic), c(from), c(per_step), c(turn), c.points(points, value);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    Coefficients<N> c;
    for (const VariableInfo& info : kVariables)
      if (P(static_cast<double>(info.variable)) == p[0]) {
        c.variable = info.variable;
        c.periodic = info.periodic;
      }
    c.balance = p[1] == P(1.0) ? Balance::transmission : p[1] == P(2.0) ? Balance::load : Balance::motor;
    c.times_direction = p[2] != P(0.0);
    while (c.points < kMostPoints && P(static_cast<double>(c.points)) < p[3]) ++c.points;
    if (c.periodic) {
      const bool motor = c.variable == Variable::motor_angle;
      c.turn = N::order((motor ? d.turn_angle_scale : P(1.0)) * d.angle_base);
    } else {
      const P base = base_of(c.variable, d);
      c.from = N::value(p[4] / base);
      c.per_step = N::ratio_gain((p[3] - P(1.0)) * base / (p[5] - p[4]));
    }
    const P torque = c.balance == Balance::motor ? d.torque_base : d.output_torque_base;
    for (int k = 0; k < c.points; ++k) c.value[k] = N::value(p[kStated + k] / torque);
    return c;
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    const auto& angle = c.variable == Variable::output_angle ? in.output_angle : in.angle;
    auto torque = c.periodic ? N::table_over_turn(c.value, c.points, N::times_order(angle, c.turn))
                             : N::table(c.value, c.points, N::ratio(c.per_step, signal_of<N>(c.variable, in) - c.from));
    if (c.times_direction) torque = N::times(torque, direction_on<N>(c.balance, in));
    torque_on<N>(c.balance, out) += N::sum(torque);
  }
};
FLEXSPLINE_EFFECT(45, TableEffect);

}  // namespace flexspline::effects
