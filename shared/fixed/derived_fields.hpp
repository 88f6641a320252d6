// The fields of a coefficient that follow from mantissa and exponent, computed with integers only. So a parameter block
// needs only mantissa and exponent, and host and drive agree to the bit.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/elementary.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::fixed {

namespace detail {
// Bit by bit: a library's division of 64 bits is larger than this whole file. `by` is below 2^31.
constexpr std::uint64_t divided(std::uint64_t dividend, std::uint32_t by) {
  std::uint64_t quotient = dividend;
  std::uint32_t rest = 0;
  for (int bit = 0; bit < 64; ++bit) {
    rest = (rest << 1) | static_cast<std::uint32_t>(quotient >> 63);
    quotient <<= 1;
    if (rest < by) continue;
    rest -= by;
    quotient |= 1;
  }
  return quotient;
}
// largest / (mantissa 2^(exponent - 30)) in units of 2^-input_bits, rounded down; zero counts as a half.
// `largest_q20` below 2^37.
constexpr std::uint64_t input_limit(std::uint64_t largest_q20, std::int32_t mantissa, int exponent, int input_bits,
                                    std::uint64_t most) {
  const std::uint64_t size = mantissa == 0 ? std::uint64_t{1} << (kMantissaBits - 1) : size_of(mantissa);
  const int zeros = std::countl_zero(largest_q20);
  const std::uint64_t quotient = divided(largest_q20 << zeros, static_cast<std::uint32_t>(size));
  const int up = input_bits + kMantissaBits - 20 - zeros - exponent;
  if (up <= -64) return 0;
  if (up < 0) return quotient >> -up < most ? quotient >> -up : most;
  if (up >= std::countl_zero(quotient)) return most;
  return quotient << up < most ? quotient << up : most;
}
template <class G>
constexpr bool derive_fields(G& g, std::uint64_t largest_q20, int input_bits) {
  g.limit = static_cast<std::int32_t>(input_limit(largest_q20, g.mantissa, g.exponent, input_bits, 0x7FFFFFFF));
  return g.limit > 0;
}
}  // namespace detail

// Each sets the derived fields; false where no input is left that the coefficient could be applied to.
constexpr bool derive_fields(Gain& g) {
  if (!detail::derive_fields(g, kLargestValueQ20, kValueBits)) return false;
  // The largest input shifted up by one less than the exponent fits a word.
  const int shift = g.exponent - 1;
  g.up = static_cast<std::uint8_t>(shift > 0 ? shift : 0);
  g.factor = static_cast<std::int32_t>(limited<std::int64_t>(
      shift_right(std::int64_t{g.mantissa} * 2, shift < 0 ? -shift : 0), -0x7FFFFFFF, 0x7FFFFFFF));
  return true;
}
constexpr bool derive_fields(StepGain& g) {
  if (!detail::derive_fields(g, std::uint64_t{31} << 20, kAngleBits)) return false;
  // A travel is steps times mantissa 2^(exponent - 4) in Q58. The mantissa keeps as many bits as a product with the
  // largest input, shifted up, has room for. For gains below a thousandth per turn that is less than an error bound
  // needs; the packer's comparison with double detects that.
  constexpr int kUp = kTravelBits - kAngleBits - kMantissaBits;
  const auto size = static_cast<std::uint64_t>(size_of(g.mantissa)) << 2;
  const int shift = g.exponent + kUp - 2;
  g.up = static_cast<std::uint8_t>(shift > 0 && shift < 32 ? shift : 0);
  if (shift >= 32) return false;
  g.factor = static_cast<std::uint32_t>(limited<std::int64_t>(
      shift_right(static_cast<std::int64_t>(size), shift < 0 ? -shift : 0), 0, std::int64_t{0xFFFFFFFF}));
  constexpr std::uint64_t kPerLn2 = 0xB8AA3B29;  // Q31
  g.exponent_of_two = static_cast<std::uint32_t>((g.factor * kPerLn2 + (std::uint64_t{1} << 31)) >> 32);
  // The input shifted up has to fit a word.
  const std::int64_t most = std::int64_t{0xFFFFFFFF} >> g.up;
  if (g.limit > most) g.limit = static_cast<std::int32_t>(most);
  g.near = static_cast<std::uint32_t>(detail::input_limit(std::uint64_t{2} << 20, g.mantissa, g.exponent, kAngleBits,
                                                          static_cast<std::uint64_t>(g.limit)));
  return true;
}
constexpr bool derive_fields(RatioGain& g) {
  if (!detail::derive_fields(g, std::uint64_t{1} << 37, kValueBits)) return false;
  g.near = g.bell = 0;
  g.up = 0;
  g.log = -(std::int32_t{31} << 25);
  if (g.mantissa == 0) return true;
  const auto size = static_cast<std::uint64_t>(size_of(g.mantissa));
  g.log = static_cast<std::int32_t>(shift_right(
      log2_of(size) + (std::int64_t{g.exponent - kMantissaBits + 31 - kValueBits} << kLogBits), kLogBits - 25));
  // Times 1.2011, the root of log2(e): as a mantissa from 1/2 to 1 in Q32 and a power of two.
  constexpr std::uint64_t kRoot = 0x99BE610C;  // Q31
  std::uint64_t bell = (size * kRoot + (std::uint64_t{1} << 28)) >> 29;
  int exponent = g.exponent;
  if (bell > 0xFFFFFFFF) {
    bell = (bell + 1) >> 1;
    ++exponent;
  }
  if (bell > 0xFFFFFFFF) bell = 0xFFFFFFFF;
  const int shift = exponent + 1;
  if (shift >= 32) return false;
  g.up = static_cast<std::uint8_t>(shift > 0 ? shift : 0);
  g.bell = static_cast<std::uint32_t>(shift < 0 ? (shift <= -32 ? 0 : bell >> -shift) : bell);
  // Where 2^-(w^2) is below half a unit, w = 5.29.
  constexpr std::uint64_t kGoneQ20 = 5546967;
  const std::uint64_t mantissa = bell >> 2;
  g.near = static_cast<std::uint32_t>(
      detail::input_limit(kGoneQ20, static_cast<std::int32_t>(mantissa), exponent, kValueBits, 0x7FFFFFFF));
  if (g.up > 0 && g.near > (0xFFFFFFFFU >> g.up)) g.near = 0xFFFFFFFFU >> g.up;
  return g.near > 0;
}
constexpr bool derive_fields(DistanceGain& g) {
  constexpr std::uint64_t kMost = 0x7FFFFFFFFFFFFFFF;
  g.limit = 0;
  g.factor = 0;
  g.down = 0;
  if (g.mantissa == 0) return true;
  g.limit =
      static_cast<std::int64_t>(detail::input_limit(std::uint64_t{4} << 20, g.mantissa, g.exponent, kAngleBits, kMost));
  if (g.limit <= 0) return false;
  // The limited input as a word, with as many bits as fit: the factor is gain 2^(59 - 32 + down).
  const int bits = 64 - std::countl_zero(static_cast<std::uint64_t>(g.limit));
  g.down = static_cast<std::int8_t>(bits - 31);
  g.factor = static_cast<std::int32_t>(
      limited<std::int64_t>(shift_right(g.mantissa, kMantissaBits - (kStateBits - kAngleBits) - g.down - g.exponent),
                            -0x7FFFFFFF, 0x7FFFFFFF));
  return true;
}
constexpr bool derive_fields(Harmonic& h) {
  constexpr std::int64_t kMost = std::int64_t{1} << 62;
  constexpr int kRest = kOrderBits - 32;
  if (h.order <= -kMost || h.order >= kMost || h.amplitude == INT32_MIN) return false;
  h.whole = static_cast<std::int32_t>(h.order >> kOrderBits);
  // The remainder is signed, as turns are.
  const auto fraction = static_cast<std::uint64_t>(h.order) & ((std::uint64_t{1} << kOrderBits) - 1);
  const std::uint64_t rounded = fraction + (std::uint64_t{1} << (kRest - 1));
  h.fraction = static_cast<std::uint32_t>(rounded >> kRest);
  if ((rounded >> kOrderBits) != 0) ++h.whole;
  h.remainder = static_cast<std::int32_t>(static_cast<std::uint32_t>(fraction << (32 - kRest)));
  return true;
}

}  // namespace flexspline::fixed
