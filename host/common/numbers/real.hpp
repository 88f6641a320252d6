// The number system of the host and the twin: everything is a plain double in SI units.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace flexspline::numbers {

// Functions on any scalar for which std:: or argument-dependent lookup has the elementary functions.
template <class S>
struct ScalarSystem {
  using Parameter = S;
  using Value = S;
  using Angle = S;
  using Step = S;
  using Sum = S;
  using Gain = S;
  using Weight = S;
  using StepGain = S;
  using RatioGain = S;
  using DistanceGain = S;
  using Ratio = S;
  using Exponent = S;
  using Order = S;
  using State = S;
  using Share = S;
  using Travel = S;
  struct Wave {
    S cosine;
    S sine;
  };

  // A wave over an angle by its two amplitudes, so that it stays linear in them.
  struct Harmonic {
    S order;
    S cosine;
    S sine;
  };
  static Harmonic harmonic(const S& order, const S& cosine, const S& sine) { return {order, cosine, sine}; }
  static S wave(const Harmonic& h, const S& angle) {
    const Wave w = sincos(h.order * angle);
    return h.cosine * w.cosine + h.sine * w.sine;
  }
  static S wave_times(const Harmonic& h, const S& angle, const S& x) { return x * wave(h, angle); }
  static S weight(const S& p) { return p; }
  static S gain(const S& p) { return p; }
  static S step_gain(const S& p) { return p; }
  static S ratio_gain(const S& p) { return p; }
  static S distance_gain(const S& p) { return p; }
  static S value(const S& p) { return p; }
  static S share(const S& p) { return p; }
  static S exponent(const S& p) { return p; }
  static S order(const S& p) { return p; }
  static S power(const S& p, const S& exponent) {
    using std::pow;
    return pow(p, exponent);
  }
  static S one() { return S(1.0); }
  static S sum(const S& x) { return x; }
  static S narrow(const S& x) { return x; }
  static S widen(const S& x) { return x; }
  static S bounded(const S& x) { return x; }
  static S times(const S& a, const S& b) { return a * b; }
  static S times_gain(const S& a, const S& b) { return a * b; }
  static S scaled(const S& gain, const S& x) { return gain * x; }
  static S ratio(const S& gain, const S& x) { return gain * x; }
  static S signal(const S& gain, const S& x) { return gain * x; }
  static S travel(const S& gain, const S& x) { return gain * x; }
  // Of a bound that nears zero the travel over it grows without end.
  static S over(const S& travel, const S& x) { return travel / (x < S(1e-12) ? S(1e-12) : x); }
  static S times_power(const S& travel, const S& x, const S& exponent) {
    using std::pow;
    return travel * pow(x < S(1e-9) ? S(1e-9) : x, exponent);
  }
  static S step(const S& travel, const S& x) { return travel * x; }
  static S times_order(const S& angle, const S& order) { return angle * order; }
  static S sign(const S& x) { return S(x > S(0.0) ? 1.0 : x < S(0.0) ? -1.0 : 0.0); }
  static S magnitude(const S& x) { return x < S(0.0) ? -x : x; }
  static S clamp(const S& x, const S& limit) { return x > limit ? limit : x < -limit ? -limit : x; }
  static S between(const S& x, const S& low, const S& high) { return x > high ? high : x < low ? low : x; }
  static S clamp_to_one(const S& x) { return clamp(x, S(1.0)); }
  static S by_sign(const S& x, const S& a, const S& b) { return x < S(0.0) ? b : a; }
  // Moves to `target` and keeps `share` of the distance; no motion, no change.
  static S relax(const S& from, const S& target, const S& share) { return target + (from - target) * share; }
  // Linear interpolation between `points` values: at a position counted in points from the first, held beyond both
  // ends; and at a phase, a turn being the whole table.
  template <std::size_t Size>
  static S table(const std::array<S, Size>& values, int points, const S& at) {
    if (!(at > S(0.0)) || points < 2) return values[0];
    if (at >= S(points - 1.0)) return values[points - 1];
    const double index = std::floor(plain(at));
    const auto k = static_cast<std::size_t>(index);
    return values[k] + (values[k + 1] - values[k]) * (at - S(index));
  }
  template <std::size_t Size>
  static S table_over_turn(const std::array<S, Size>& values, int points, const S& phase) {
    const S turns = phase * S(0.5 * std::numbers::inv_pi);
    const S at = (turns - S(std::floor(plain(turns)))) * S(static_cast<double>(points));
    const double index = std::min(std::floor(plain(at)), points - 1.0);
    const auto k = static_cast<std::size_t>(index);
    const std::size_t next = k + 1 < static_cast<std::size_t>(points) ? k + 1 : 0;
    return values[k] + (values[next] - values[k]) * (at - S(index));
  }
  static Wave sincos(const S& x) {
    using std::cos;
    using std::sin;
    return {cos(x), sin(x)};
  }
  // Integers of 2^-32, as control counts on a drive: positions and distances in turns, a value, the wave at a phase.
  static S angle(std::int64_t q32) { return S(static_cast<double>(q32) * 0x1p-32); }
  static S steps(std::int64_t q32) { return angle(q32); }
  static S value_of(std::int64_t q32) { return angle(q32); }
  static Wave wave(std::uint32_t q32) { return sincos(S(2.0 * std::numbers::pi) * angle(q32)); }
  static S distance(const S& gain, const S& x) { return gain * x; }
  static S gauss(const S& x) {
    using std::exp;
    return exp(-x * x);
  }
  static S exp_negative(const S& x) {
    using std::exp;
    return exp(-x);
  }
  static S lorentzian(const S& x) { return S(1.0) / (S(1.0) + x * x); }
  static S reciprocal(const S& x) { return S(1.0) / x; }
  // (1 - exp(-x)) / x
  static S exp_mean(const S& x) {
    using std::exp;
    if (x < S(1e-4)) return S(1.0) - x * (S(0.5) - x * S(1.0 / 6.0));
    return (S(1.0) - exp(-x)) / x;
  }
  // The solution at x of u' = -u^q, u(0) = 1. For q < 1 it reaches zero and stays there.
  static S q_exp_negative(const S& x, const S& q) {
    using std::exp;
    using std::log;
    const S z = (q - S(1.0)) * x;
    if (z <= S(-1.0 + 1e-12)) return S(0.0);
    // log(1 + z) / (q - 1), in a form that has no gap at q = 1.
    const bool small = z < S(1e-4) && z > S(-1e-4);
    const S per = small ? S(1.0) - z * (S(0.5) - z * (S(1.0 / 3.0) - z * S(0.25))) : log(S(1.0) + z) / z;
    return exp(-x * per);
  }

 private:
  // Without a derivative.
  static double plain(const S& x) {
    if constexpr (requires { x.a; })
      return x.a;
    else
      return x;
  }
};

struct Real : ScalarSystem<double> {
  static double pow_abs(double x, double exponent) { return std::pow(std::abs(x), exponent); }
};

}  // namespace flexspline::numbers
