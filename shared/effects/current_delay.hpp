#pragma once
#include "shared/effects/effect.hpp"

namespace flexspline::effects {

struct CurrentDelay {
  static constexpr Description kInfo{
      .name = "current_delay",
      .reads = kCurrent,
      .equation = "Km (i(t) - i(t-d))",
      .shows_over = "current slope",
      .source = "sampling, filters",
      .explanation = "The current acts on the motor later than the log says.",
      .consequence =
          "Phase is lost at high frequency: the current loop and everything around it has less margin than the log "
          "suggests.",
      .causes =
          "Filters and sampling in the amplifier, a command that was logged instead of the measured current, a "
          "position that is filtered or sent late, clocks that differ.",
      .check =
          "Compare the time stamps of current and position, look for a filter of the encoder's signal and in the "
          "amplifier's monitor output, log the measured current and not the command.",
      .confused_with = "inertia",
      .separated_by = "motion at several frequencies up to the current loop's bandwidth",
  };
  static constexpr ParameterInfo kParameters[] = {
      {.name = "delay",
       .symbol = "d",
       .unit = units::kTime,
       .kind = Kind::nonlinear,
       .usual = 1e-3,
       .low = 1e-6,
       .high = 0.02},
  };
  template <class N>
  struct Coefficients {
    typename N::Weight torque;
    typename N::Gain per_time;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(torque), c(per_time);
    }
  };
  // The delay's first-order all-pass, 2/(1 + s d/2) - 1, whose phase errs by (2 pi f d)^3/12. The state is how far the
  // low-pass in it lags behind the current: zero at rest, so that a record may begin at any current.
  template <class N>
  struct State {
    typename N::State lag{};
  };
  template <class N, class P>
  static Coefficients<N> derive(const P* p, const DriveConstants<P>& d) {
    const P two(2.0);
    return {N::weight(two * d.torque_constant * d.current_base / d.torque_base), N::gain(two * d.time_base / p[0])};
  }
  // Exact for a current that is linear between two inputs.
  template <class N>
  static void advance(State<N>& state, const Coefficients<N>& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Travel share = N::travel(c.per_time, now.elapsed);
    const typename N::State rise = N::times(N::widen(now.current - before.current), N::exp_mean(share));
    state.lag = N::bounded(N::relax(state.lag, typename N::State{}, N::exp_negative(share)) + rise);
  }
  template <class N>
  static void evaluate(const State<N>& state, const Coefficients<N>& c, const Inputs<N>&, Torques<N>& out) {
    out.motor += c.torque * N::narrow(state.lag);
  }
};
FLEXSPLINE_EFFECT(29, CurrentDelay);

}  // namespace flexspline::effects
