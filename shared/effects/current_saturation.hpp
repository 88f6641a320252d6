#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CurrentSaturation : Stateless {
  static constexpr Description kInfo{
      .name = "current_saturation",
      .reads = kCurrent,
      .equation = "Km (i - sat(i))",
      .shows_over = "current, clipped",
      .source = "report eq. 26",
      .explanation = "The amplifier gives no more than its limit, although the log shows a larger current.",
      .consequence = "Fast starts are slower than commanded and the controller winds up.",
      .causes =
          "A current limit in the amplifier, a supply voltage that is too low at speed; the logged current is "
          "the command.",
      .check =
          "Look for a current or power limit in the amplifier's settings and at the supply voltage under load; log the "
          "measured current.",
      .confused_with = "torque_constant_saturation",
      .separated_by = "slow sine of current with a rising amplitude in locked load",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "limit",
       .symbol = "sat",
       .unit = units::kCurrent,
       .kind = Kind::nonlinear,
       .usual = 3.0,
       .low = 1e-6,
       .limit = Limit::current},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::Value limit;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(limit);
    }
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    return {N::weight(d.torque_constant * d.current_base / d.torque_base), N::value(p[0] / d.current_base)};
  }
  template <class N>
  static void evaluate(const State<N>&, const Coefficients<N>& c, const Inputs<N>& in, Torques<N>& out) {
    out.motor += c.torque * (in.current - N::clamp(in.current, c.limit));
  }
};
FLEXSPLINE_EFFECT(28, CurrentSaturation);

}  // namespace flexspline::effects
