// Elementary functions on integers. Each states its format and its largest error, which a test checks against long
// double over the whole domain. Polynomials are Chebyshev interpolations of the named function, rounded to their
// format.
//
// Qn: an integer of n fractional bits.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"

namespace flexspline::fixed {

inline constexpr int kTravelBits = 58;
inline constexpr std::uint64_t kLargestTravel = std::uint64_t{31} << kTravelBits;  // exp(-31) is 3e-14
inline constexpr std::uint64_t kLn2 = 0x2C5C85FDF473DE7;                           // ln 2 in Q58
inline constexpr int kLogBits = 40;

// (1 - exp(-x))/x for x in Q31 from 0 to ln 2, in Q30; within 2 units of Q30.
constexpr std::int32_t decay_mean(std::int32_t x) {
  constexpr std::int32_t kCoefficients[] = {1073741824, -536870911, 178956950, -44739004,
                                            8946486,    -1487049,   205584,    -19634};
  return polynomial(kCoefficients, x);
}

// A travel in Q58, up to kLargestTravel, as a multiple of ln 2 and a remainder below ln 2.
struct SplitTravel {
  int count = 0;
  std::uint64_t rest = 0;
};
constexpr SplitTravel split_travel(std::uint64_t travel) {
  // 1/ln 2 rounded down, so that the first count is at most one too few.
  constexpr std::uint64_t kPerLn2 = 0xB8AA3B29;  // Q31
  SplitTravel split;
  split.count = static_cast<int>(((travel >> 32) * kPerLn2) >> (31 + kTravelBits - 32));
  split.rest = travel - static_cast<std::uint64_t>(split.count) * kLn2;
  if (split.rest >= kLn2) {
    split.rest -= kLn2;
    ++split.count;
  }
  return split;
}

// 1 - exp(-x) for x in Q58 below ln 2, in Q60, within 2e-9 of itself: exact for the smallest travel too.
constexpr std::uint64_t decay_lost(std::uint64_t rest) {
  const auto mean = static_cast<std::uint64_t>(decay_mean(static_cast<std::int32_t>(rest >> (kTravelBits - 31))));
  return multiply_down(rest, mean, 28);
}

// exp(-x) for x in Q58, in Q60, within 1e-9; 1 - exp(-x) within 2e-9 of itself.
constexpr std::uint64_t decay(std::uint64_t travel) {
  const SplitTravel split = split_travel(travel);
  return ((std::uint64_t{1} << 60) - decay_lost(split.rest)) >> split.count;
}

// 2^x for x in Q31 from 0 to 1, in Q30; within 3.2 units of Q30.
constexpr std::uint32_t power_of_two(std::int32_t x) {
  // (2^x - 1)/x, as the whole would not fit a signed number at one.
  constexpr std::int32_t kCoefficients[] = {744261126, 257941089, 59598342, 10322487, 1441968, 153573, 23239};
  return (std::uint32_t{1} << 30) + static_cast<std::uint32_t>(multiply31(polynomial(kCoefficients, x), x));
}

// One over m for m in Q31 from 1/2 to 1, in Q30, within 3 units of Q30: a linear approximation within 1/17 of it, and
// three steps of Newton's method, each of which squares the relative error.
constexpr std::uint32_t reciprocal_of_mantissa(std::uint32_t m) {
  constexpr std::uint64_t kTwo = std::uint64_t{1} << 32;  // Q31
  // (48 - 32 m)/17, rounded down: in two divisions of 32 bits, as one of 64 is a call to a library where words have 32.
  const std::uint32_t rest = 0xC0000000U - m;
  std::uint64_t r = 32 * std::uint64_t{rest / 17} + 32 * (rest % 17) / 17;
  for (int step = 0; step < 3; ++step) r = (r * (kTwo - ((r * m) >> 31))) >> 31;
  return static_cast<std::uint32_t>((r + 1) >> 1);
}

// One over x as mantissa (Q30, from 1 to 2) and power of two: 1/x = mantissa 2^-30 2^exponent; x from 1 on.
struct Reciprocal {
  std::uint32_t mantissa = 0;
  int exponent = 0;
};
constexpr Reciprocal reciprocal_of(std::uint64_t x) {
  const int zeros = std::countl_zero(x);
  return {reciprocal_of_mantissa(static_cast<std::uint32_t>((x << zeros) >> 33)), zeros - 64};
}

// log2(x) of an integer x from 1 on, in Q40, within 8e-11: a table has a factor that brings the mantissa close to one.
namespace detail {
struct LogTable {
  std::uint32_t factor[32]{};  // 1/(1 + (i + 1/2)/32), Q31
  std::int64_t log[32]{};      // -log2 of it, Q40
};
// Bit by bit: the square of the mantissa passes two where the next bit of the logarithm is one.
constexpr LogTable make_log_table() {
  LogTable table;
  for (std::uint64_t i = 0; i < 32; ++i) {
    table.factor[i] =
        static_cast<std::uint32_t>((std::uint64_t{1} << 37) / (65 + 2 * i) +
                                   ((((std::uint64_t{1} << 37) % (65 + 2 * i)) * 2 >= 65 + 2 * i) ? 1 : 0));
    std::uint64_t mantissa = std::uint64_t{table.factor[i]} << 32;  // Q62, from 1 to 2: twice the factor
    std::int64_t bits = 0;
    for (int k = 0; k < kLogBits; ++k) {
      mantissa = multiply_down(mantissa, mantissa, 62);
      const bool passes = mantissa >= (std::uint64_t{1} << 63);
      bits = 2 * bits + (passes ? 1 : 0);
      if (passes) mantissa >>= 1;
    }
    table.log[i] = (std::int64_t{1} << kLogBits) - bits;
  }
  return table;
}
inline constexpr LogTable kLogTable = make_log_table();
}  // namespace detail

constexpr std::int64_t log2_of(std::uint64_t x) {
  // log2(1 + r)/r for r from -1/62 to 1/62.
  constexpr std::int32_t kCoefficients[] = {1549082005, -774540997, 516360664, -387352490, 309886673};  // Q30
  const int zeros = std::countl_zero(x);
  const std::uint64_t mantissa = x << zeros;  // Q63
  const auto i = static_cast<std::size_t>((mantissa >> 58) & 31);
  // mantissa times factor, less one; as the product is close to one, the difference fits Q36.
  const std::uint64_t near_one = multiply_down(mantissa, detail::kLogTable.factor[i], 31);  // Q63
  const auto r = static_cast<std::int64_t>(near_one - (std::uint64_t{1} << 63));
  const auto r31 = static_cast<std::int32_t>(shift_right(r, 32));
  const std::int64_t part = multiply_round(r >> 12, polynomial(kCoefficients, r31), 41);  // Q51, Q30 to Q40
  return (static_cast<std::int64_t>(63 - zeros) << kLogBits) + detail::kLogTable.log[i] + part;
}

// 2^y for y in Q40 as mantissa (Q30, from 1 to 2) and power of two; relative error 4e-9.
struct Power {
  std::uint32_t mantissa = 0;
  int exponent = 0;
};
constexpr Power power_of_two_of(std::int64_t y) {
  const std::int64_t fraction = y & ((std::int64_t{1} << kLogBits) - 1);
  return {power_of_two(static_cast<std::int32_t>(fraction >> (kLogBits - 31))), static_cast<int>(y >> kLogBits)};
}

// Sine and cosine of a phase in 2^-32 turns, in Q30, within 4 units of Q30. The nearest quarter turn is subtracted.
struct SineCosine {
  std::int32_t sine = 0;
  std::int32_t cosine = 0;
};
namespace detail {
// Not inside the function, where compilers copy them to the stack first.
inline constexpr std::int32_t kSineEighth[] = {843314857, -86699833, 2674039, -39269, 332};  // sin(pi/4 t)/t over t^2
inline constexpr std::int32_t kCosineEighth[] = {1073741824, -331168967, 17023452, -349974, 3790};  // cos(pi/4 t)
}  // namespace detail
constexpr SineCosine sine_cosine(std::uint32_t phase) {
  const std::uint32_t quarter = (phase + (std::uint32_t{1} << 29)) >> 30;
  const auto rest = static_cast<std::int32_t>(phase - (quarter << 30));  // an eighth of a turn to each side
  const std::int32_t t = rest * 4;                                       // Q31
  // A square of exactly one would not fit; one unit less does.
  const auto whole = static_cast<std::uint32_t>(static_cast<std::uint64_t>(long_product(t, t)) >> 31);
  const auto square = static_cast<std::int32_t>(whole - (whole >> 31));
  const std::int32_t sine = add_high(0, polynomial(detail::kSineEighth, square) * 2, t);
  const std::int32_t cosine = polynomial(detail::kCosineEighth, square);
  switch (quarter & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

// log(1 + z)/z for z in Q31 from -1/16 to 1/16, in Q30; within 2 units of Q30.
constexpr std::int32_t log_mean(std::int32_t z) {
  constexpr std::int32_t kCoefficients[] = {1073741824, -536870913, 357913942, -268433655,
                                            214746764,  -179878075, 154210485};
  return polynomial(kCoefficients, z);
}

}  // namespace flexspline::fixed
