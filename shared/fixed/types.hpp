// The number types of a drive. They are distinct, so that using one for another does not compile;
// README.md has formats and ranges.
#pragma once

#include <compare>
#include <cstdint>

namespace flexspline::fixed {

inline constexpr int kValueBits = 27;
inline constexpr int kAngleBits = 32;
inline constexpr int kStateBits = 59;
inline constexpr int kSumBits = 54;
inline constexpr int kRatioBits = 44;
inline constexpr int kMantissaBits = 30;
inline constexpr int kExponentBits = 28;
inline constexpr int kOrderBits = 48;
inline constexpr int kShareBits = 63;
inline constexpr std::uint64_t kLargestValueQ20 =
    (std::uint64_t{16} << 20) - (std::uint64_t{1} << 13);  // largest result of a gain

// A signal, in bases.
struct Value {
  std::int32_t raw = 0;
  friend constexpr auto operator<=>(Value, Value) = default;
};
// Difference of two positions, in 2^-32 turns.
struct Step {
  std::int64_t raw = 0;
  friend constexpr Step operator-(Step a, Step b) {
    return {static_cast<std::int64_t>(static_cast<std::uint64_t>(a.raw) - static_cast<std::uint64_t>(b.raw))};
  }
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
// A torque before it is narrowed: exact products of a weight and a value.
struct Sum {
  std::int64_t raw = 0;
  friend constexpr Sum operator+(Sum a, Sum b) {
    return {static_cast<std::int64_t>(static_cast<std::uint64_t>(a.raw) + static_cast<std::uint64_t>(b.raw))};
  }
  constexpr Sum& operator+=(Sum b) { return *this = *this + b; }
};
// A state and shares of it.
struct State {
  std::int64_t raw = 0;
};
// The fraction of a state that is kept or passed on, from zero to just below one.
struct Share {
  std::uint64_t raw = 0;
};
// A distance over a characteristic length, from 0 to 31, beyond which all functions of it are at their limit.
struct Travel {
  std::uint64_t raw = 0;
};
// A signal over its characteristic size, up to 2^17.
struct Ratio {
  std::int64_t raw = 0;
};
// The torque for a value of one, in bases. Multiplies without a shift and without rounding.
struct Weight {
  std::int32_t raw = 0;
};
// A wave over an angle as amplitude and phase, so that one sine is computed and not two. The order is split as its
// product with an angle needs it (derived_fields.hpp).
struct Harmonic {
  std::int64_t order = 0;      // as `Order`
  std::uint32_t phase = 0;     // of the sine, 2^-32 turns
  std::int32_t amplitude = 0;  // as `Weight`
  std::int32_t whole = 0;
  std::uint32_t fraction = 0;  // 2^-32
  std::int32_t remainder = 0;  // 2^-64
};
// Coefficients mantissa 2^(exponent - 30). The input is clamped to `limit` before the product, so that it always fits;
// a limit of zero marks a coefficient that cannot be used. `factor` 2^up is the same number in 2^-30.
struct Gain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 32;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::uint8_t up = 0;
  std::int32_t factor = 0;
  std::int32_t limit = 0;
};
// Per turn, of steps. `factor` 2^up is the same number in 2^-26 units of a travel; `exponent_of_two` 2^up times 2
// log2(e) of it.
struct StepGain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 60;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::uint8_t up = 0;
  std::int32_t limit = 0;
  std::uint32_t factor = 0;
  std::uint32_t exponent_of_two = 0;
  std::uint32_t near = 0;  // steps that make a signal of two
};
// One over a characteristic size of a signal. `bell` 2^up is that number times the root of log2(e), for inputs up to
// `near`; `log` is log2 of it in Q25, of signals that are shifted up until their highest bit is set.
struct RatioGain {
  static constexpr int kLeastExponent = -40;
  static constexpr int kMostExponent = 60;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::uint8_t up = 0;
  std::int32_t limit = 0;
  std::uint32_t near = 0;
  std::uint32_t bell = 0;
  std::int32_t log = 0;
};
// The same for distances of many turns: the input has 64 bits, the result stays within four.
struct DistanceGain {
  static constexpr int kLeastExponent = -60;  // a product below has to be shifted by less than a word
  static constexpr int kMostExponent = 30;
  std::int32_t mantissa = 0;
  std::int8_t exponent = 0;
  std::int8_t down = 0;  // shift of the limited input, so that its product with `factor` is a state
  std::int32_t factor = 0;
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
