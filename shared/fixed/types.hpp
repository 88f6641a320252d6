// The kinds of numbers that a drive computes with. Each is a type of its own, so that a mix-up does not compile;
// README.md has formats and ranges.
#pragma once

#include <compare>
#include <cstdint>

namespace flexspline::fixed {

inline constexpr int kValueBits = 27;
inline constexpr int kAngleBits = 32;
inline constexpr int kStateBits = 60;
inline constexpr int kSumBits = 44;
inline constexpr int kRatioBits = 44;
inline constexpr int kMantissaBits = 30;
inline constexpr int kExponentBits = 28;
inline constexpr int kOrderBits = 48;
inline constexpr int kShareBits = 63;
inline constexpr std::uint64_t kLargestValueQ20 =
    (std::uint64_t{16} << 20) - (std::uint64_t{1} << 13);  // what a gain may give

// A signal, in bases.
struct Value {
  std::int32_t raw = 0;
  friend constexpr auto operator<=>(Value, Value) = default;
};
// Difference of two positions, in 2^-32 turns.
struct Step {
  std::int64_t raw = 0;
};
// A position in 2^-32 turns; it wraps after 2^31 turns.
struct Angle {
  std::int64_t raw = 0;
  friend constexpr Step operator-(Angle a, Angle b) {
    return {static_cast<std::int64_t>(static_cast<std::uint64_t>(a.raw) - static_cast<std::uint64_t>(b.raw))};
  }
  friend constexpr Angle operator+(Angle a, Step b) {
    return {static_cast<std::int64_t>(static_cast<std::uint64_t>(a.raw) + static_cast<std::uint64_t>(b.raw))};
  }
};
// A torque before it is narrowed: a term is below 16 bases, so that half a million of them fit.
struct Sum {
  std::int64_t raw = 0;
  friend constexpr Sum operator+(Sum a, Sum b) { return {a.raw + b.raw}; }
  constexpr Sum& operator+=(Sum b) { return *this = *this + b; }
};
// Inner state and shares of it.
struct State {
  std::int64_t raw = 0;
};
// What part of a state is kept or passed on, 0 to 1.
struct Share {
  std::uint64_t raw = 0;
};
// A distance over a characteristic length, from 0 to 31, where all functions of it have reached their limit.
struct Travel {
  std::uint64_t raw = 0;
};
// A signal over a characteristic size of it, up to 2^17.
struct Ratio {
  std::int64_t raw = 0;
};
// Coefficients mantissa 2^(exponent - 30). The input is clamped to `limit` before it is multiplied, so that the product
// always fits; a limit of nought marks one that cannot be used.
struct Gain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 60;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::int32_t limit = 0;
};
struct StepGain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 60;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::int32_t limit = 0;
};
struct RatioGain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 60;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::int32_t limit = 0;
};
// The same for distances of many turns: the input has 64 bits, the result stays within four.
struct DistanceGain {
  static constexpr int kLeastExponent = -60;  // a product below has to be shifted by less than a word
  static constexpr int kMostExponent = 30;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::int64_t limit = 0;
};
// Of a power, -8 to 8.
struct Exponent {
  std::int32_t raw = 0;
};
// Cycles per turn.
struct Order {
  std::int64_t raw = 0;
};

}  // namespace flexspline::fixed
