// The number system of the host and the twin: everything is a plain double in SI units.
#pragma once

#include <algorithm>
#include <cmath>

namespace flexspline::numbers {

// Functions on any scalar for which std:: or argument-dependent lookup has the elementary functions.
template <class S>
struct ScalarSystem {
  using Parameter = S;
  using Value = S;
  using Angle = S;
  using Step = S;
  using Sum = S;
  using Share = S;
  using Gain = S;
  using StepGain = S;
  using Exponent = S;
  using Order = S;
  using State = S;
  struct Wave {
    S cosine;
    S sine;
  };

  static S share(const S& p) { return p; }
  static S gain(const S& p) { return p; }
  static S step_gain(const S& p) { return p; }
  static S value(const S& p) { return p; }
  static S exponent(const S& p) { return p; }
  static S order(const S& p) { return p; }
  static S sum(const S& x) { return x; }
  static S narrow(const S& x) { return x; }
  static S times(const S& a, const S& b) { return a * b; }
  static S scaled(const S& gain, const S& x) { return gain * x; }
  static S times_order(const S& angle, const S& order) { return angle * order; }
  static S sign(const S& x) { return S(x > S(0.0) ? 1.0 : x < S(0.0) ? -1.0 : 0.0); }
  static S magnitude(const S& x) { return x < S(0.0) ? -x : x; }
  static S clamp(const S& x, const S& limit) { return x > limit ? limit : x < -limit ? -limit : x; }
  // Moves to `target` and keeps `share` of the distance; no motion, no change.
  static S relax(const S& from, const S& target, const S& share) { return target + (from - target) * share; }
  static Wave sincos(const S& x) {
    using std::cos;
    using std::sin;
    return {cos(x), sin(x)};
  }
  static S gauss(const S& x) {
    using std::exp;
    return exp(-x * x);
  }
  static S exp_negative(const S& x) {
    using std::exp;
    return exp(-x);
  }
};

struct Real : ScalarSystem<double> {
  static double pow_abs(double x, double exponent) { return std::pow(std::abs(x), exponent); }
};

}  // namespace flexspline::numbers
