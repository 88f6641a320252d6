// Coefficients from floating point. For the host: nothing here is instantiated on a drive.
#pragma once

#include <cstdint>
#include <limits>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/findings.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::fixed {

inline constexpr double kLargestValue = 15.99;  // of what a gain may give, in bases
inline constexpr double kLargestStep = 31.0;
inline constexpr double kLargestRatio = 131072.0;

// x 2^power, exact as long as nothing falls below the smallest double.
constexpr double scaled_by_power(double x, int power) {
  for (; power > 0; --power) x *= 2.0;
  for (; power < 0; ++power) x *= 0.5;
  return x;
}
constexpr bool is_finite(double x) {
  return x - x == 0.0;
}
// The nearest integer; nought and a note where x is not below 2^bits.
inline std::int64_t nearest(double x, double below, std::string_view what) {
  if (!is_finite(x) || x >= below || x <= -below) {
    Findings::note(what);
    return 0;
  }
  return static_cast<std::int64_t>(x < 0.0 ? x - 0.5 : x + 0.5);
}

inline Value make_value(double x) {
  return {static_cast<std::int32_t>(
      nearest(scaled_by_power(x, kValueBits), 2147483647.0, "a value is not below 16 bases"))};
}
inline Share make_share(double x) {
  if (!(x >= 0.0 && x <= 1.0)) {
    Findings::note("a share is not between nought and one");
    return {};
  }
  return {static_cast<std::uint64_t>(scaled_by_power(x, kShareBits) + 0.5)};
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

// A coefficient whose input has `input_bits` fractional bits and whose result stays below `largest`.
template <class G>
G make_coefficient(double x, double largest, int input_bits) {
  G g;
  if (!is_finite(x)) {
    Findings::note("a coefficient is not finite");
    return g;
  }
  double size = x < 0.0 ? -x : x;
  if (size < 1e-12) size = 0.0;  // less than a unit of any result
  int exponent = 0;
  for (; size >= 1.0; size *= 0.5) ++exponent;
  for (; size < 0.5 && size > 0.0; size *= 2.0) --exponent;
  const double limit = scaled_by_power(largest / (size > 0.0 ? size : 0.5), input_bits - exponent);
  if (limit < 1.0 || exponent > 60) {
    Findings::note("a coefficient leaves no input that it could be applied to: another base is needed");
    return g;
  }
  g.mantissa = static_cast<std::int32_t>(nearest(scaled_by_power(x < 0.0 ? -size : size, kMantissaBits), 1.1e9, ""));
  g.exponent = static_cast<std::int8_t>(exponent);
  g.limit = limit < 2147483647.0 ? static_cast<std::int32_t>(limit) : std::numeric_limits<std::int32_t>::max();
  return g;
}
inline Gain make_gain(double x) {
  return make_coefficient<Gain>(x, kLargestValue, kValueBits);
}
inline StepGain make_step_gain(double x) {
  return make_coefficient<StepGain>(x, kLargestStep, kAngleBits);
}
inline RatioGain make_ratio_gain(double x) {
  return make_coefficient<RatioGain>(x, kLargestRatio, kValueBits);
}

// Per unit of angle (a turn), from distances of up to 2^31 turns to a state that stops at four.
inline DistanceGain make_distance_gain(double x) {
  constexpr int kLeastExponent = -60;  // a product below has to be shifted by less than a word
  constexpr int kMostExponent = 30;
  const double size = x < 0.0 ? -x : x;
  DistanceGain g;
  if (size == 0.0) return g;
  int exponent = 0;
  double mantissa = size;
  for (; mantissa >= 1.0 && exponent <= kMostExponent; mantissa *= 0.5) ++exponent;
  for (; mantissa < 0.5 && exponent >= kLeastExponent; mantissa *= 2.0) --exponent;
  if (!is_finite(x) || exponent > kMostExponent || exponent < kLeastExponent) {
    Findings::note("a gain of a distance is not between 1e-18 and 1e9");
    return g;
  }
  const double limit = scaled_by_power(4.0 / size, kAngleBits);
  g.mantissa =
      static_cast<std::int32_t>(nearest(scaled_by_power(x < 0.0 ? -mantissa : mantissa, kMantissaBits), 1.1e9, ""));
  g.exponent = static_cast<std::int8_t>(exponent);
  g.limit = limit < 9e18 ? static_cast<std::int64_t>(limit) : std::numeric_limits<std::int64_t>::max();
  return g;
}

}  // namespace flexspline::fixed
