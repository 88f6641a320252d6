// Clarke and Park transforms in integers, amplitude invariant: the length of the vector is the amplitude of a phase.
//   alpha = (2a - b - c)/3, beta = (b - c)/sqrt(3)           the part common to all phases drops out
//   d = alpha cos + beta sin, q = beta cos - alpha sin       angle of the rotor's flux against phase a
#pragma once

#include <bit>
#include <cstdint>
#include <type_traits>

#include "shared/fixed/word.hpp"

namespace flexspline::control::foc {

// The unit of the numbers is that of what is transformed; currents are in 2^-27 of their base, as fixed::Value.
struct Phases {
  std::int32_t a = 0;
  std::int32_t b = 0;
  std::int32_t c = 0;
};
struct StatorVector {
  std::int32_t alpha = 0;
  std::int32_t beta = 0;
};
struct RotorVector {
  std::int32_t d = 0;
  std::int32_t q = 0;
};
// Of an electrical angle, 2^-30.
struct Rotation {
  std::int32_t cosine = 0;
  std::int32_t sine = 0;
};

namespace detail {
// A phase within a quarter turn to either side, of the same sine.
constexpr std::int32_t folded(std::uint32_t phase) {
  const bool beyond = static_cast<std::int32_t>(phase ^ (phase << 1)) < 0;
  return static_cast<std::int32_t>(beyond ? 0x80000000U - phase : phase);
}
}  // namespace detail
// As two times fixed::sine_word, side by side: a coefficient is loaded once for both.
constexpr Rotation rotation(std::uint32_t angle) {
  constexpr std::uint32_t kQuarter = 0x40000000;
  const std::int32_t* table = fixed::detail::in_memory(fixed::detail::kSine);
  const std::int32_t s = detail::folded(angle), c = detail::folded(angle + kQuarter);
  const std::int32_t s2 = fixed::multiply_high(s, s) * 4, c2 = fixed::multiply_high(c, c) * 4;
  const fixed::detail::Pair high = fixed::detail::load_pair<2>(table);
  std::int32_t sine = fixed::add_high(high.second, table[4], s2), cosine = fixed::add_high(high.second, table[4], c2);
  sine = fixed::add_high(high.first, sine, s2);
  cosine = fixed::add_high(high.first, cosine, c2);
  const fixed::detail::Pair low = fixed::detail::load_pair<0>(table);
  sine = fixed::add_high(low.second, sine, s2);
  cosine = fixed::add_high(low.second, cosine, c2);
  sine = fixed::add_high(low.first, sine, s2);
  cosine = fixed::add_high(low.first, cosine, c2);
  return {fixed::multiply_high(c, cosine) * 8, fixed::multiply_high(s, sine) * 8};
}

namespace detail {
// Of an eighth of a turn times x, over x^2: sine/x and cosine, 2^-30.
inline constexpr std::int32_t kSmallSine[] = {843314857, -86699834, 2674041};
inline constexpr std::int32_t kSmallCosine[] = {1073741824, -331168970, 17023473};
}  // namespace detail
// Further by `step`, up to a sixteenth of a turn to each side: within 6e-6 at its ends, 1e-7 at half of that.
constexpr Rotation rotated(const Rotation& r, std::int32_t step) {
  const std::int32_t x = step * 8, square = fixed::multiply_high(x, x);
  const std::int32_t sine = fixed::multiply_high(x, fixed::detail::horner(detail::kSmallSine, square));
  const std::int32_t cosine = fixed::detail::horner(detail::kSmallCosine, square);
  return {fixed::add_high(fixed::multiply_high(r.cosine, cosine), -r.sine, sine) * 4,
          fixed::add_high(fixed::multiply_high(r.sine, cosine), r.cosine, sine) * 4};
}
// x within -2^Bits and 2^Bits - 1: SSAT, which compilers do not find in a comparison.
template <int Bits>
constexpr std::int32_t saturated_signed(std::int32_t x) {
#if defined(__arm__) && defined(__thumb2__)
  if (!std::is_constant_evaluated()) {
    std::int32_t y;
    asm("ssat %0, %2, %1" : "=r"(y) : "r"(x), "n"(Bits + 1));
    return y;
  }
#endif
  constexpr std::int32_t kMost = (std::int32_t{1} << Bits) - 1;
  return x < -kMost - 1 ? -kMost - 1 : x > kMost ? kMost : x;
}

// As what is left of one: a product with it and the difference are one instruction.
inline constexpr std::int32_t kOneLessPerRootThree = 1815266771;  // 2^-32
inline constexpr std::int32_t kOneLessHalfRootThree = 575416509;  // 2^-32
inline constexpr std::int32_t kThird = 1431655765;                // 2^-32

// Of numbers below 2^29.
constexpr StatorVector clarke(const Phases& x) {
  const std::int32_t across = x.b - x.c;
  return {fixed::multiply_high(2 * x.a - x.b - x.c, kThird), fixed::add_high(across, across, -kOneLessPerRootThree)};
}
constexpr Phases inverse_clarke(const StatorVector& x) {
  const std::int32_t half = x.alpha >> 1, rest = fixed::add_high(x.beta, x.beta, -kOneLessHalfRootThree);
  return {x.alpha, rest - half, -half - rest};
}
// A quarter of the result: its unit is four times as large as that of what comes in.
constexpr RotorVector park_quarter(const StatorVector& x, const Rotation& r) {
  return {fixed::add_high(fixed::multiply_high(x.alpha, r.cosine), x.beta, r.sine),
          fixed::add_high(fixed::multiply_high(x.beta, r.cosine), -x.alpha, r.sine)};
}
constexpr StatorVector inverse_park_quarter(const RotorVector& x, const Rotation& r) {
  return {fixed::add_high(fixed::multiply_high(x.d, r.cosine), -x.q, r.sine),
          fixed::add_high(fixed::multiply_high(x.d, r.sine), x.q, r.cosine)};
}

namespace detail {
// sqrt(x) over x - 0.625 from 1/4 to 1, 2^-30.
inline constexpr std::int32_t kRoot[] = {848867446,  679275888, -271879468, 207288759,
                                         -204003474, 372528512, -462844598};
}  // namespace detail
// The square root of x in 2^-32, in 2^-31; within 4e-5 of itself and a unit. The lowest bit of x
// counts as set, so that zero needs no case of its own: its root is 1.5e-5 of one.
constexpr std::uint32_t root_word(std::uint32_t x) {
  constexpr std::uint32_t kMiddle = 0xA0000000;
  const auto shift = static_cast<std::uint32_t>(std::countl_zero(x | 1)) & 30;
  const auto mantissa = static_cast<std::int32_t>(((x | 1) << shift) - kMiddle);
  return (static_cast<std::uint32_t>(fixed::detail::horner(detail::kRoot, mantissa)) * 2) >> (shift / 2);
}

}  // namespace flexspline::control::foc
