// Coefficients from floating point. For the host only.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/derived_fields.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::fixed {

// x 2^power, exact unless it underflows.
constexpr double scaled_by_power(double x, int power) {
  for (; power > 0; --power) x *= 2.0;
  for (; power < 0; ++power) x *= 0.5;
  return x;
}
constexpr bool is_finite(double x) {
  return x - x == 0.0;
}
// The nearest integer; zero and an entry in the log where x is not below 2^bits.
inline std::int64_t nearest(double x, double below, std::string_view what) {
  if (!is_finite(x) || x >= below || x <= -below) {
    OverflowLog::note(what);
    return 0;
  }
  return static_cast<std::int64_t>(x < 0.0 ? x - 0.5 : x + 0.5);
}

inline Value make_value(double x) {
  return {static_cast<std::int32_t>(
      nearest(scaled_by_power(x, kValueBits), 2147483647.0, "a value is not below 16 bases"))};
}
inline Weight make_weight(double x) {
  return {static_cast<std::int32_t>(
      nearest(scaled_by_power(x, kValueBits), 2147483647.0, "a torque of one signal is not below 16 bases"))};
}
inline Share make_share(double x) {
  if (!(x >= 0.0 && x <= 1.0)) {
    OverflowLog::note("a share is not between zero and one");
    return {};
  }
  constexpr std::uint64_t kOne = std::uint64_t{1} << kShareBits;
  const auto raw = static_cast<std::uint64_t>(scaled_by_power(x, kShareBits) + 0.5);
  return {raw < kOne ? raw : kOne - 1};
}
inline Exponent make_exponent(double x) {
  return {static_cast<std::int32_t>(
      nearest(scaled_by_power(x, kExponentBits), 2147483647.0, "an exponent is not between -8 and 8"))};
}
// From radians of phase per turn: the drive counts both in turns.
inline Order make_order(double radians_per_turn) {
  constexpr double kTurn = 6.283185307179586;
  return {nearest(scaled_by_power(radians_per_turn / kTurn, kOrderBits), scaled_by_power(1.0, 62),
                  "an order is not below 16384 cycles a turn")};
}

// cosine cos(order q) + sine sin(order q), the order in radians per turn.
inline Harmonic make_harmonic(double radians_per_turn, double cosine, double sine) {
  constexpr double kTurn = 6.283185307179586;
  Harmonic h;
  h.order = make_order(radians_per_turn).raw;
  h.amplitude = make_weight(__builtin_sqrt(cosine * cosine + sine * sine)).raw;
  h.phase = static_cast<std::uint32_t>(
      static_cast<std::uint64_t>(nearest(__builtin_atan2(cosine, sine) / kTurn * 0x1p32, 0x1p33, "")));
  derive_fields(h);
  return h;
}

// Mantissa and exponent of a number, rounded; a mantissa of one is written as a half of the next power. Below `least`
// it is zero.
template <class G>
G make_floating(double x, double least) {
  G g;
  if (!is_finite(x)) {
    OverflowLog::note("a coefficient is not finite");
    return g;
  }
  double size = x < 0.0 ? -x : x;
  if (size < least) return g;
  int exponent = 0;
  for (; size >= 1.0; size *= 0.5) ++exponent;
  for (; size < 0.5; size *= 2.0) --exponent;
  if (exponent > G::kMostExponent || exponent < G::kLeastExponent) {
    OverflowLog::note("a coefficient is too large or too small for its format: another base is needed");
    return g;
  }
  g.mantissa = static_cast<std::int32_t>(nearest(scaled_by_power(x < 0.0 ? -size : size, kMantissaBits), 1.1e9, ""));
  g.exponent = static_cast<std::int8_t>(exponent);
  return g;
}
// With its derived fields, or with a limit of zero and an entry in the log.
template <class G>
G make_coefficient(double x, double least) {
  G g = make_floating<G>(x, least);
  if (!derive_fields(g)) {
    OverflowLog::note("a coefficient leaves no input that it could be applied to: another base is needed");
    return {};
  }
  return g;
}
inline constexpr double kLargestValue = kLargestValueQ20 * 0x1p-20;  // result of a gain, in bases
inline constexpr double kLeastCoefficient = 1e-12;                   // less than a unit of any result
inline Gain make_gain(double x) {
  return make_coefficient<Gain>(x, kLeastCoefficient);
}
inline StepGain make_step_gain(double x) {
  return make_coefficient<StepGain>(x, kLeastCoefficient);
}
inline RatioGain make_ratio_gain(double x) {
  return make_coefficient<RatioGain>(x, kLeastCoefficient);
}
// Per unit of angle (a turn), from distances of up to 2^31 turns to a state that stops at four; zero, or from 1e-18
// to 1e9.
inline DistanceGain make_distance_gain(double x) {
  return make_coefficient<DistanceGain>(x, 1e-300);
}

}  // namespace flexspline::fixed
