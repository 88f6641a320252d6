// Velocity and acceleration from the counts of an encoder, by a Kalman filter in its steady state (report sections 4.1
// and 4.3, after Belanger): the shaft's acceleration is a random walk, driven by white jerk, and rounding to counts is
// a measurement noise of a twelfth of a count squared.
//
// All three states count in velocity bases: the position error times the corner frequency w, the velocity, and the
// acceleration over w. So one format holds them for any corner, and every coefficient is a share (a corner above one
// radian a tick does not give one, which derive() detects). The position itself is not a state: only the difference of
// two readings enters, which wraps, and the position error keeps the part that was not used yet, so that no count is
// lost in slow motion.
#pragma once

#include <cstdint>

#include "shared/effects/effect.hpp"
#include "shared/observers/riccati.hpp"

namespace flexspline::observers {

// The assumptions about motion and encoder, in the units of the motor's position (rad on a rotary axis).
template <class P>
struct KalmanSetup {
  P encoder_counts{};  // per motor turn, after quadrature
  P jerk_density{};    // of the white jerk, (rad/s^3)^2/Hz: how fast accelerations are expected to change
};

// Host only: the variance of rounding to counts, rad^2.
template <class P>
P count_variance(const P& encoder_counts, const effects::DriveConstants<P>& d) {
  const P count = P(6.283185307179586) / (encoder_counts * d.turn_angle_scale);
  return count * count / P(12.0);
}
// Host only: the setup whose filter has the corner frequency (the magnitude of its three poles, 60 degrees apart)
// `corner_rad_s`: S = T r w^6.
template <class P>
KalmanSetup<P> setup_for_corner(const P& encoder_counts, const P& corner_rad_s, const effects::DriveConstants<P>& d) {
  const P cube = corner_rad_s * corner_rad_s * corner_rad_s;
  return {encoder_counts, d.time_base * count_variance(encoder_counts, d) * cube * cube};
}

// The gains of the filter for states scaled as above; they depend on the corner frequency times the tick only.
template <class P>
struct KalmanGains {
  P corner{};  // w T
  P position{};
  P velocity{};
  P acceleration{};
};
// Host only. The model over one tick, with h = w T, and the covariances over w^2 times the count's variance.
template <class P>
KalmanGains<P> kalman_gains(const P& h) {
  const P one(1.0), none(0.0), square = h * h;
  const Matrix3<P> model{{{one, h, square / P(2.0)}, {none, one, h}, {none, none, one}}};
  const Matrix3<P> noise{{{square * square * square / P(20.0), square * square * h / P(8.0), square * square / P(6.0)},
                          {square * square * h / P(8.0), square * square / P(3.0), square * h / P(2.0)},
                          {square * square / P(6.0), square * h / P(2.0), square}}};
  const auto gain = steady_gain(steady_covariance(model, noise, one), one);
  return {h, gain[0], gain[1], gain[2]};
}

struct EncoderKalman {
  template <class N>
  struct Coefficients {
    typename N::StepGain per_step;
    typename N::Share tick;       // h
    typename N::Share half_tick;  // h/2
    typename N::Share kept;       // one less the gain of the position
    typename N::Share velocity;
    typename N::Share acceleration;
    typename N::Gain acceleration_scale;  // from velocity bases times w to acceleration bases
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(per_step), c(tick), c(half_tick), c(kept), c(velocity), c(acceleration), c(acceleration_scale);
    }
  };
  template <class N>
  struct State {
    typename N::Angle before{};
    typename N::State position_error{};  // measured less estimated position after the last reading, times w
    typename N::State velocity{};
    typename N::State acceleration{};  // over w
    bool started = false;
  };
  template <class N>
  struct Estimate {
    typename N::Value velocity{};
    typename N::Value acceleration{};
  };

  // Host only. The drive's tick is `d.time_base`, in seconds.
  template <class N, class P>
  static Coefficients<N> derive(const KalmanSetup<P>& setup, const effects::DriveConstants<P>& d) {
    const P variance = count_variance(setup.encoder_counts, d);
    const P corner = N::power(setup.jerk_density / (variance * d.time_base), P(1.0 / 6.0));
    return coefficients<N>(kalman_gains(corner * d.time_base), d);
  }
  // Host only: from gains that are known already.
  template <class N, class P>
  static Coefficients<N> coefficients(const KalmanGains<P>& g, const effects::DriveConstants<P>& d) {
    // Rounded to 2^-31, as a tick multiplies with one word: the gains differ from the optimum by 1e-6 at 5 Hz, and the
    // host uses the same filter.
    const auto in_a_word = [](const P& x) {
      return P(static_cast<double>(static_cast<std::int64_t>(static_cast<double>(x) * 0x1p31 + 0.5)) * 0x1p-31);
    };
    const P half = in_a_word(g.corner / P(2.0));
    return {N::step_gain(d.angle_base / (d.velocity_base * d.time_base)),
            N::share(half + half),
            N::share(half),
            N::share(in_a_word(P(1.0) - g.position)),
            N::share(in_a_word(g.velocity)),
            N::share(in_a_word(g.acceleration)),
            N::gain(g.corner / d.time_base * d.velocity_base / d.acceleration_base)};
  }

  // One tick: takes a reading and returns the estimates at the time of that reading, in bases. The first call only
  // stores the shaft's angle.
  template <class N>
  static constexpr Estimate<N> update(State<N>& s, const Coefficients<N>& c, typename N::Angle reading) {
    if (!s.started) [[unlikely]] {
      s.before = reading;
      s.started = true;
    }
    const auto travelled = N::signal(c.per_step, reading - s.before);
    s.before = reading;
    const auto half_rise = N::times_gain(s.acceleration, c.half_tick);
    const auto expected = s.velocity + half_rise;
    // The new position error is the innovation less the correction of the position.
    const auto innovation = s.position_error + N::times_gain(travelled - expected, c.tick);
    s.position_error = N::times_gain(innovation, c.kept);
    s.velocity = expected + half_rise + N::times_gain(innovation, c.velocity);
    s.acceleration = s.acceleration + N::times_gain(innovation, c.acceleration);
    return {N::narrow(s.velocity), N::scaled(c.acceleration_scale, N::narrow(s.acceleration))};
  }
};

// The largest magnitudes of the states and intermediate sums, in velocity bases, for readings that move by at most two
// bases a tick, to which N::signal limits them; and whether all fit a state, which ends at eight.
struct KalmanBounds {
  double innovation = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
  double sums = 0.0;
  bool fit = false;
};
// Host only. The filter is linear, so the bound is twice the sum of the magnitudes of its impulse response; round-off
// (five roundings a tick of a few units of 2^-59) is an input as well, and far below the margin.
inline KalmanBounds kalman_bounds(const KalmanGains<double>& g) {
  constexpr double kEnvelope = 2.0, kMargin = 1e-6, kRange = 8.0;
  constexpr double kTimeConstants = 100.0;  // the slowest poles decay with half the corner frequency
  double error = 0.0, velocity = 0.0, acceleration = 0.0, travelled = 1.0;
  KalmanBounds sum;
  double expected_sum = 0.0, difference_sum = 0.0, predicted_sum = 0.0;
  const long ticks = static_cast<long>(kTimeConstants / g.corner) + 100;
  for (long k = 0; k < ticks; ++k) {
    const double expected = velocity + acceleration * g.corner / 2.0;
    const double innovation = error + (travelled - expected) * g.corner;
    const double predicted = velocity + acceleration * g.corner;
    error = innovation * (1.0 - g.position);
    velocity = predicted + innovation * g.velocity;
    acceleration += innovation * g.acceleration;
    expected_sum += detail::size_of(expected);
    difference_sum += detail::size_of(travelled - expected);
    predicted_sum += detail::size_of(predicted);
    sum.innovation += detail::size_of(innovation);
    sum.velocity += detail::size_of(velocity);
    sum.acceleration += detail::size_of(acceleration);
    travelled = 0.0;
  }
  const auto bound = [](double x) { return kEnvelope * x + kMargin; };
  sum.sums = 0.0;
  for (const double x : {expected_sum, difference_sum, predicted_sum})
    if (bound(x) > sum.sums) sum.sums = bound(x);
  sum.innovation = bound(sum.innovation);
  sum.velocity = bound(sum.velocity);
  sum.acceleration = bound(sum.acceleration);
  sum.fit = sum.innovation < kRange && sum.velocity < kRange && sum.acceleration < kRange && sum.sums < kRange;
  return sum;
}

}  // namespace flexspline::observers
