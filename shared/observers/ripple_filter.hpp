// Removes torque ripple of a known order from a torque signal (report section 5.3: a Kalman filter on a harmonic
// oscillator). The oscillator's phase is the order times the motor's angle, so the filter estimates the mean of the
// torque and the amplitudes of cosine and sine,
//   torque = mean + a cos(phase) + b sin(phase),
// all three as random walks per unit of travel: its bandwidth in orders is the same at every speed, and it does not
// change while the shaft is at rest.
#pragma once

#include "shared/effects/effect.hpp"

namespace flexspline::observers {

template <class P>
struct RippleSetup {
  P order{};           // cycles per motor turn
  P memory{};          // motor angle (rad on a rotary axis) after which 1/e of an old amplitude is left
  P largest_ripple{};  // limit of the amplitudes of cosine and sine, N m at the output
};

struct RippleFilter {
  template <class N>
  struct Coefficients {
    typename N::StepGain per_travel;
    typename N::Order order;
    typename N::Value largest;
    typename N::Value mean_part;  // of the innovation, at full gain
    typename N::Value wave_part;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(per_travel), c(order), c.limit(largest), c.unsigned_one(mean_part), c.unsigned_one(wave_part);
    }
  };
  template <class N>
  struct State {
    typename N::Angle before{};
    typename N::State mean{};
    typename N::State cosine{};
    typename N::State sine{};
    // The results of take(), for learn().
    decltype(N::exp_negative(typename N::Travel{})) kept{};  // of a difference to where the torque is
    typename N::Wave wave{};
    typename N::Value torque{};
    bool started = false;
  };

  // Host only. Torques are of the output side, as a torque sensor measures them.
  template <class N, class P>
  static Coefficients<N> derive(const RippleSetup<P>& setup, const effects::DriveConstants<P>& d) {
    // Gains of 1/3, 2/3 and 2/3 make the full step a projection, so that no innovation is used more than once: the
    // estimates cannot become unstable for any order of the phases. On average over a turn an amplitude, and the mean,
    // then follow with a third of the step.
    const P part = P(1.0) / P(3.0);
    return {N::step_gain(d.angle_base / (part * setup.memory)),
            N::order(setup.order * d.turn_angle_scale * d.angle_base),
            N::value(setup.largest_ripple / d.output_torque_base), N::value(part), N::value(part + part)};
  }

  // One tick: takes the shaft's angle and the torque, within two bases, and returns the torque without the ripple. The
  // first call only stores both.
  template <class N>
  static constexpr typename N::Value update(State<N>& s, const Coefficients<N>& c, typename N::Angle angle,
                                            typename N::Value torque) {
    take<N>(s, c, angle, torque);
    return torque - learn<N>(s, c);
  }
  // The same in two parts, for two ticks: take() stores the inputs, and learn() updates the estimates and returns the
  // ripple of the stored torque. As everything depends on travel, it need not run at every tick.
  template <class N>
  static constexpr void take(State<N>& s, const Coefficients<N>& c, typename N::Angle angle, typename N::Value torque) {
    if (!s.started) {
      s.before = angle;
      s.mean = N::bounded(N::widen(torque));
      s.started = true;
    }
    const typename N::Travel travel = N::travel(c.per_travel, N::magnitude(angle - s.before));
    s.kept = N::exp_negative(travel);
    s.before = angle;
    s.wave = N::sincos(N::times_order(angle, c.order));
    s.torque = torque;
  }
  template <class N>
  static constexpr typename N::Value learn(State<N>& s, const Coefficients<N>& c) {
    const auto innovation = s.torque - N::narrow(s.mean) - ripple<N>(s, s.wave);
    // Random walks do not forget, and drift where the phase does not distinguish them, so each is limited.
    const auto moved = [&s](typename N::State from, typename N::Value by) {
      const typename N::State all = N::widen(by);
      return from + (all - N::relax(all, {}, s.kept));
    };
    s.mean = N::bounded(moved(s.mean, N::times(c.mean_part, innovation)));
    const auto part = N::times(c.wave_part, innovation);
    s.cosine = N::clamp(moved(s.cosine, N::times(part, s.wave.cosine)), c.largest);
    s.sine = N::clamp(moved(s.sine, N::times(part, s.wave.sine)), c.largest);
    return ripple<N>(s, s.wave);
  }
  // The ripple at another angle, for ticks that do not learn.
  template <class N>
  static constexpr typename N::Value ripple_at(const State<N>& s, const Coefficients<N>& c, typename N::Angle angle) {
    return ripple<N>(s, N::sincos(N::times_order(angle, c.order)));
  }

 private:
  template <class N>
  static constexpr typename N::Value ripple(const State<N>& s, const typename N::Wave& wave) {
    return N::times(N::narrow(s.cosine), wave.cosine) + N::times(N::narrow(s.sine), wave.sine);
  }
};

}  // namespace flexspline::observers
