// What a drive keeps with a coefficient beside mantissa and exponent. It follows from these by integers alone, so that
// a parameter block needs only them, and host and drive agree to the bit.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::fixed {

namespace detail {
// largest / (mantissa 2^(exponent - 30)) in units of 2^-input_bits, rounded down; nought counts as a half.
// `largest_q20` below 2^37.
constexpr std::uint64_t input_limit(std::uint64_t largest_q20, std::int32_t mantissa, int exponent, int input_bits,
                                    std::uint64_t most) {
  const std::uint64_t size = mantissa == 0 ? std::uint64_t{1} << (kMantissaBits - 1) : size_of(mantissa);
  const std::uint64_t quotient = (largest_q20 << 26) / size;  // of 46 - 30 fractional bits
  const int up = input_bits - 16 - exponent;
  if (up <= -64) return 0;
  if (up < 0) return quotient >> -up < most ? quotient >> -up : most;
  if (up >= std::countl_zero(quotient)) return most;
  return quotient << up < most ? quotient << up : most;
}
template <class G>
constexpr bool complete(G& g, std::uint64_t largest_q20, int input_bits) {
  g.limit = static_cast<std::int32_t>(input_limit(largest_q20, g.mantissa, g.exponent, input_bits, 0x7FFFFFFF));
  return g.limit > 0;
}
}  // namespace detail

// Each sets the limit of the input; false where it leaves no input that the coefficient could be applied to.
constexpr bool complete(Gain& g) {
  return detail::complete(g, kLargestValueQ20, kValueBits);
}
constexpr bool complete(StepGain& g) {
  return detail::complete(g, std::uint64_t{31} << 20, kAngleBits);
}
constexpr bool complete(RatioGain& g) {
  return detail::complete(g, std::uint64_t{1} << 37, kValueBits);
}
constexpr bool complete(DistanceGain& g) {
  constexpr std::uint64_t kMost = 0x7FFFFFFFFFFFFFFF;
  g.limit = g.mantissa == 0 ? 0
                            : static_cast<std::int64_t>(detail::input_limit(std::uint64_t{4} << 20, g.mantissa,
                                                                            g.exponent, kAngleBits, kMost));
  return g.mantissa == 0 || g.limit > 0;
}

}  // namespace flexspline::fixed
