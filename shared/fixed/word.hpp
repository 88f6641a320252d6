// Functions on one word of 32 bits, for the tick: 12 to 24 instructions each, the same number in each run. Each states
// its formats and its largest error, which a test checks against long double over the whole domain. Polynomials are
// Chebyshev interpolations of the named function, rounded to their format.
//
// Qn: an integer of n fractional bits.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace flexspline::fixed {

// Products of two words. Cortex-M0 has no long multiplication: the product is made from halves of 16 bits.
#if defined(__ARM_ARCH_6M__)
namespace detail {
// From halves, the upper ones signed where the numbers are. No step exceeds 32 bits.
[[gnu::noinline]] inline std::int64_t signed_product(std::int32_t a, std::int32_t b) {
  const auto a0 = static_cast<std::int32_t>(a & 0xFFFF), b0 = static_cast<std::int32_t>(b & 0xFFFF);
  const std::int32_t a1 = a >> 16, b1 = b >> 16;
  const std::uint32_t low = static_cast<std::uint32_t>(a0) * static_cast<std::uint32_t>(b0);
  const std::int32_t one = a1 * b0 + static_cast<std::int32_t>(low >> 16);
  const std::int32_t two = a0 * b1 + (one & 0xFFFF);
  const auto high = static_cast<std::uint32_t>(a1 * b1 + (one >> 16) + (two >> 16));
  return static_cast<std::int64_t>((std::uint64_t{high} << 32) |
                                   ((static_cast<std::uint32_t>(two) << 16) | (low & 0xFFFF)));
}
[[gnu::noinline]] inline std::int32_t sum_with_high(std::int32_t c, std::int32_t a, std::int32_t b) {
  const auto a0 = static_cast<std::int32_t>(a & 0xFFFF), b0 = static_cast<std::int32_t>(b & 0xFFFF);
  const std::int32_t a1 = a >> 16, b1 = b >> 16;
  const std::uint32_t low = static_cast<std::uint32_t>(a0) * static_cast<std::uint32_t>(b0);
  const std::int32_t one = a1 * b0 + static_cast<std::int32_t>(low >> 16);
  const std::int32_t two = a0 * b1 + (one & 0xFFFF);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(c) +
                                   static_cast<std::uint32_t>(a1 * b1 + (one >> 16) + (((two >> 15) + 1) >> 1)));
}
[[gnu::noinline]] inline std::uint64_t unsigned_product(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t a0 = a & 0xFFFF, a1 = a >> 16, b0 = b & 0xFFFF, b1 = b >> 16;
  const std::uint32_t low = a0 * b0, one = a1 * b0 + (low >> 16), two = a0 * b1 + (one & 0xFFFF);
  return (std::uint64_t{a1 * b1 + (one >> 16) + (two >> 16)} << 32) | ((two << 16) | (low & 0xFFFF));
}
}  // namespace detail
constexpr std::uint64_t long_product(std::uint32_t a, std::uint32_t b) {
  return std::is_constant_evaluated() ? std::uint64_t{a} * b : detail::unsigned_product(a, b);
}
constexpr std::int64_t long_product(std::int32_t a, std::int32_t b) {
  return std::is_constant_evaluated() ? std::int64_t{a} * b : detail::signed_product(a, b);
}
#else
constexpr std::uint64_t long_product(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{a} * b;
}
constexpr std::int64_t long_product(std::int32_t a, std::int32_t b) {
  return std::int64_t{a} * b;
}
#endif

// c + a b 2^-32, rounded to the nearest (halves up): SMMLAR where the processor has it, as compilers do not generate
// it. Sums wrap.
constexpr std::int32_t add_high(std::int32_t c, std::int32_t a, std::int32_t b) {
#if defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP
  if (!std::is_constant_evaluated()) {
    std::int32_t sum;
    asm("smmlar %0, %1, %2, %3" : "=r"(sum) : "r"(a), "r"(b), "r"(c));
    return sum;
  }
#elif defined(__ARM_ARCH_6M__)
  if (!std::is_constant_evaluated()) return detail::sum_with_high(c, a, b);
#endif
  const auto product = static_cast<std::uint64_t>(long_product(a, b)) + (std::uint64_t{1} << 31);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(c) + static_cast<std::uint32_t>(product >> 32));
}
// a b 2^-32, rounded to the nearest: SMMULR.
constexpr std::int32_t multiply_high(std::int32_t a, std::int32_t b) {
#if defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP
  if (!std::is_constant_evaluated()) {
    std::int32_t product;
    asm("smmulr %0, %1, %2" : "=r"(product) : "r"(a), "r"(b));
    return product;
  }
#endif
  return add_high(0, a, b);
}
// a b 2^-32, rounded down.
constexpr std::uint32_t multiply_high(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint32_t>(long_product(a, b) >> 32);
}
// a b 2^-bits, rounded down; the caller guarantees that it fits.
constexpr std::int32_t multiply_shift(std::int32_t a, std::int32_t b, int bits) {
  return static_cast<std::int32_t>(long_product(a, b) >> bits);
}
// Prevents the compiler from widening the word and multiplying all 64 bits.
constexpr std::int32_t as_word(std::int32_t x) {
#if defined(__arm__)
  if (!std::is_constant_evaluated()) asm("" : "+r"(x));
#endif
  return x;
}
// x 2^-bits for bits from 0 to 63, rounded down: zero beyond 31.
constexpr std::uint32_t shift_down(std::uint32_t x, std::uint32_t bits) {
#if defined(__arm__) && defined(__thumb2__)
  if (!std::is_constant_evaluated()) {
    std::uint32_t down;
    asm("lsr %0, %1, %2" : "=r"(down) : "r"(x), "r"(bits));
    return down;
  }
#endif
  return bits > 31 ? 0 : x >> bits;
}
// The lowest word of x 2^bits for bits from 0 to 63.
constexpr std::uint32_t shift_up(std::uint32_t x, std::uint32_t bits) {
#if defined(__arm__) && defined(__thumb2__)
  if (!std::is_constant_evaluated()) {
    std::uint32_t up;
    asm("lsl %0, %1, %2" : "=r"(up) : "r"(x), "r"(bits));
    return up;
  }
#endif
  return bits > 31 ? 0 : x << bits;
}
// a - b, saturated to a word.
constexpr std::int32_t saturated_difference(std::int32_t a, std::int32_t b) {
#if defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP
  if (!std::is_constant_evaluated()) {
    std::int32_t difference;
    asm("qsub %0, %1, %2" : "=r"(difference) : "r"(a), "r"(b));
    return difference;
  }
#endif
  const std::int64_t difference = std::int64_t{a} - b;
  return static_cast<std::int32_t>(difference > INT32_MAX   ? INT32_MAX
                                   : difference < INT32_MIN ? INT32_MIN
                                                            : difference);
}
// x, saturated to 0 to 2^Bits - 1.
template <int Bits>
constexpr std::uint32_t saturated(std::int32_t x) {
#if defined(__arm__) && defined(__thumb2__)
  if (!std::is_constant_evaluated()) {
    std::uint32_t limited;
    asm("usat %0, %2, %1" : "=r"(limited) : "r"(x), "n"(Bits));
    return limited;
  }
#endif
  constexpr std::int32_t kMost = (std::int32_t{1} << Bits) - 1;
  return static_cast<std::uint32_t>(x < 0 ? 0 : x > kMost ? kMost : x);
}
// x 2^-Bits rounded to the nearest (halves up), for Bits from 1 to 31; the caller guarantees that it fits.
template <int Bits>
constexpr std::int32_t rounded_shift(std::int64_t x) {
#if defined(__arm__) && defined(__thumb2__)
  // The last bit that is shifted out is the carry.
  if (!std::is_constant_evaluated()) {
    std::int32_t word;
    asm("lsrs %0, %1, %3\n\tadc %0, %0, %2, lsl %4"
        : "=&r"(word)
        : "r"(static_cast<std::uint32_t>(x)), "r"(static_cast<std::int32_t>(x >> 32)), "n"(Bits), "n"(32 - Bits)
        : "cc");
    return word;
  }
#endif
  return static_cast<std::int32_t>((x + (std::int64_t{1} << (Bits - 1))) >> Bits);
}
constexpr std::uint32_t magnitude_of(std::int32_t x) {
  const auto sign = static_cast<std::uint32_t>(x >> 31);
  return (static_cast<std::uint32_t>(x) ^ sign) - sign;
}

namespace detail {
// Not inside the functions, where compilers copy them to the stack first.
inline constexpr std::int32_t kPowerOfTwo[] = {1073741824, 744261146, 257941250, 59596185, 10327310, 1438860, 166016};
inline constexpr std::int32_t kSine[] = {843314853, -1387196611, 684531186, -160602359, 20845600};
inline constexpr std::int32_t kLogMean[] = {3025551, -94558, 3940};
inline constexpr std::int32_t kHalvingMean[] = {1488522224, -1031763206, 476734752, -164875809, 44380305, -7897239};
// The address of a table. Without it compilers build its numbers from immediates, at two instructions each.
template <class T, std::size_t Size>
constexpr const T* in_memory(const T (&table)[Size]) {
  const T* at = table;
#if defined(__arm__) && !defined(__ARM_ARCH_6M__)
  if (!std::is_constant_evaluated()) asm("" : "+r"(at));
#endif
  return at;
}
// Two neighbouring numbers at once, where the processor can.
struct Pair {
  std::int32_t first = 0;
  std::int32_t second = 0;
};
template <std::size_t Index>
constexpr Pair load_pair(const std::int32_t* table) {
#if defined(__arm__) && defined(__thumb2__)
  // No memory operand: the contents of a table never change.
  if (!std::is_constant_evaluated()) {
    Pair p;
    asm("ldrd %0, %1, [%2, %3]" : "=r"(p.first), "=r"(p.second) : "r"(table), "n"(Index * sizeof(std::int32_t)));
    return p;
  }
#endif
  return {table[Index], table[Index + 1]};
}
// c0 + x (c1 + x (c2 + ...)) with x in 2^-32, from the last of `Count` coefficients on.
template <std::size_t Count>
constexpr std::int32_t horner(const std::int32_t* c, std::int32_t sum, std::int32_t x) {
  if constexpr (Count == 0) {
    return sum;
  } else if constexpr (Count == 1) {
    return add_high(c[0], sum, x);
  } else {
    const Pair p = load_pair<Count - 2>(c);
    return horner<Count - 2>(c, add_high(p.first, add_high(p.second, sum, x), x), x);
  }
}
template <std::size_t Size>
constexpr std::int32_t horner(const std::int32_t (&coefficients)[Size], std::int32_t x) {
  const std::int32_t* c = in_memory(coefficients);
  if constexpr (Size % 2 == 1) {
    return horner<Size - 1>(c, c[Size - 1], x);
  } else {
    const Pair p = load_pair<Size - 2>(c);
    return horner<Size - 2>(c, add_high(p.first, p.second, x), x);
  }
}
}  // namespace detail

// 2^x for x in Q32 from -1/2 to 1/2, in Q30; within 4 units of Q30.
constexpr std::int32_t power_of_two_word(std::int32_t x) {
  return detail::horner(detail::kPowerOfTwo, x);
}

// sin(2 pi x) for x in turns, Q32, in Q27; within 2 units.
constexpr std::int32_t sine_word(std::uint32_t phase) {
  // sin(2 pi t)/t over 16 t^2 in Q30; each coefficient is scaled by four more than the one before.
  // Beyond a quarter turn to either side: half a turn less the phase.
  const bool beyond = static_cast<std::int32_t>(phase ^ (phase << 1)) < 0;
  const auto t = static_cast<std::int32_t>(beyond ? 0x80000000U - phase : phase);
  const std::int32_t square = multiply_high(t, t);
  return multiply_high(t, detail::horner(detail::kSine, square * 4));
}

// log2(x) of an integer x from 1 on, in Q25, within 1.2 units: a table has a factor that brings the mantissa close to
// one.
namespace detail {
struct LogEntry {
  std::uint32_t factor = 0;  // 1/(1 + (i + 1/2)/32), Q32
  std::int32_t log = 0;      // -log2 of it, Q25
};
struct WordLogTable {
  LogEntry entries[32]{};
};
// Bit by bit: the square of the mantissa passes two where the next bit of the logarithm is one.
constexpr WordLogTable make_word_log_table() {
  WordLogTable table;
  for (std::uint64_t i = 0; i < 32; ++i) {
    const auto factor = static_cast<std::uint32_t>(((std::uint64_t{1} << 39) / (65 + 2 * i) + 1) / 2);
    std::uint64_t mantissa = std::uint64_t{factor} << 31;  // Q62, from 1 to 2: twice the factor
    std::int64_t bits = 0;
    constexpr int kBits = 34;
    for (int k = 0; k < kBits; ++k) {
      // Its upper half is enough for 25 bits.
      const std::uint64_t upper = mantissa >> 31;
      mantissa = upper * upper;
      const bool passes = (mantissa >> 63) != 0;
      bits = 2 * bits + (passes ? 1 : 0);
      if (passes) mantissa >>= 1;
    }
    constexpr int kDown = kBits - 25;
    table.entries[i] = {factor,
                        static_cast<std::int32_t>((((std::int64_t{1} << kBits) - bits) + (1 << (kDown - 1))) >> kDown)};
  }
  return table;
}
inline constexpr WordLogTable kWordLogTable = make_word_log_table();
}  // namespace detail

// Of the mantissa only: x is an integer that was shifted up until its highest bit is set; the result is from 0 to 1.
constexpr std::int32_t log2_of_mantissa(std::uint32_t mantissa) {
  // log2(1 + r)/r over r up to 1/62 to each side, in Q21 and sixteenths of it.
  const detail::LogEntry& entry = detail::in_memory(detail::kWordLogTable.entries)[(mantissa >> 26) & 31];
  // Close to one, so that its difference from one fits Q36: the one itself is shifted out.
  const auto r = static_cast<std::int32_t>(multiply_high(mantissa, entry.factor) << 5);
  return entry.log + multiply_high(r, detail::horner(detail::kLogMean, r));
}

// (1 - 2^-x)/x for x in Q31 from 0 to 1, in Q31; within 2e-8 of itself.
constexpr std::uint32_t halving_mean(std::int32_t x) {
  return static_cast<std::uint32_t>(detail::horner(detail::kHalvingMean, x));
}

inline constexpr std::uint64_t kAllLost = 0x7FFFFFFE00000000;  // the largest number below one

// 1 - 2^-x for x in Q57, in Q63, within 1e-8; of a small x within 2e-8 of itself.
constexpr std::uint64_t one_minus_power_of_two(std::uint64_t exponent_of_two) {
  const auto count = static_cast<std::uint32_t>(exponent_of_two >> 57) & 63;
  const std::uint64_t fraction = exponent_of_two << 7;  // Q64
  const auto upper = static_cast<std::uint32_t>(fraction >> 32);
  const std::uint32_t mean = halving_mean(static_cast<std::int32_t>(upper >> 1));
  const std::uint64_t lost = long_product(upper, mean) + multiply_high(static_cast<std::uint32_t>(fraction), mean);
  // The power of the fraction is halved as often as the integer part says; bits below a word are lost. The result stays
  // below one, so that it fits a signed word.
  constexpr std::uint32_t kAll = kAllLost >> 32;
  const std::uint32_t left = shift_down(kAll - static_cast<std::uint32_t>(lost >> 32), count);
  return (std::uint64_t{kAll - left} << 32) | static_cast<std::uint32_t>(lost);
}
// 1 - exp(-x) for x in Q58, likewise.
constexpr std::uint64_t one_minus_exp(std::uint64_t travel) {
  constexpr std::uint32_t kPerLn2 = 0xB8AA3B29;  // Q31
  const auto high = static_cast<std::uint32_t>(travel >> 32), low = static_cast<std::uint32_t>(travel);
  return one_minus_power_of_two(long_product(high, kPerLn2) + multiply_high(low, kPerLn2));
}

}  // namespace flexspline::fixed
