// Integer arithmetic for the number types: products of 64 bits and shifts that round. All functions are defined for
// every input, so that the same inputs give the same bits on every processor and at every level of optimisation.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "shared/fixed/word.hpp"

namespace flexspline::fixed {

// Product of two 64-bit numbers, from four of 32 bits.
struct Product {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
};
constexpr Product multiply_by_words(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kLow = 0xFFFFFFFF;
  const std::uint64_t low = (a & kLow) * (b & kLow);
  const std::uint64_t cross = (a >> 32) * (b & kLow) + (low >> 32);
  const std::uint64_t other = (a & kLow) * (b >> 32) + (cross & kLow);
  return {(a >> 32) * (b >> 32) + (cross >> 32) + (other >> 32), (other << 32) | (low & kLow)};
}
// The same; processors of 64 bits have an instruction for it.
constexpr Product multiply(std::uint64_t a, std::uint64_t b) {
#if defined(__SIZEOF_INT128__)
  __extension__ using Wide = unsigned __int128;
  const Wide product = Wide{a} * b;
  return {static_cast<std::uint64_t>(product >> 64), static_cast<std::uint64_t>(product)};
#elif defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP
  if (std::is_constant_evaluated()) return multiply_by_words(a, b);
  // UMAAL adds two words to a product. Compilers do not generate it; four of them make the whole product.
  const auto a0 = static_cast<std::uint32_t>(a), a1 = static_cast<std::uint32_t>(a >> 32);
  const auto b0 = static_cast<std::uint32_t>(b), b1 = static_cast<std::uint32_t>(b >> 32);
  std::uint32_t word0 = 0, word1 = 0, word2 = 0, word3 = 0;
  asm("umull %0, %1, %2, %3" : "=&r"(word0), "=&r"(word1) : "r"(a0), "r"(b0));
  asm("umaal %0, %1, %2, %3" : "+&r"(word1), "+&r"(word2) : "r"(a1), "r"(b0));
  asm("umaal %0, %1, %2, %3" : "+&r"(word1), "+&r"(word3) : "r"(a0), "r"(b1));
  asm("umaal %0, %1, %2, %3" : "+&r"(word2), "+&r"(word3) : "r"(a1), "r"(b1));
  return {(std::uint64_t{word3} << 32) | word2, (std::uint64_t{word1} << 32) | word0};
#else
  return multiply_by_words(a, b);
#endif
}

// The same with a second number of 32 bits, from two products.
constexpr Product multiply(std::uint64_t a, std::uint32_t b) {
  const std::uint64_t low = (a & 0xFFFFFFFF) * b;
  const std::uint64_t high = (a >> 32) * b + (low >> 32);
  return {high >> 32, (high << 32) | (low & 0xFFFFFFFF)};
}

// a b 2^-bits rounded down, for 0 < bits < 64; the caller guarantees that it fits.
constexpr std::uint64_t multiply_down(std::uint64_t a, std::uint64_t b, int bits) {
  const Product p = multiply(a, b);
  return (p.high << (64 - bits)) | (p.low >> bits);
}

constexpr std::uint64_t size_of(std::int64_t x) {
  const auto bits = static_cast<std::uint64_t>(x);
  return x < 0 ? 0 - bits : bits;
}
constexpr std::int64_t with_sign(std::uint64_t size, bool negative) {
  return static_cast<std::int64_t>(negative ? 0 - size : size);
}
constexpr std::int64_t negated(std::int64_t x) {
  return with_sign(size_of(x), x > 0);
}

// a b 2^-bits rounded to the nearest (halves away from zero), for 0 < bits < 64; the caller guarantees that it fits.
constexpr std::int64_t multiply_round(std::int64_t a, std::int64_t b, int bits) {
  const Product p = multiply(size_of(a), size_of(b));
  const std::uint64_t half = std::uint64_t{1} << (bits - 1);
  const std::uint64_t low = p.low + half;
  const std::uint64_t high = p.high + (low < half ? 1 : 0);
  return with_sign((high << (64 - bits)) | (low >> bits), (a < 0) != (b < 0));
}

// The same with a word, from two products.
constexpr std::int64_t multiply_word_round(std::int64_t a, std::int32_t word, int bits) {
  const Product p = multiply(size_of(a), magnitude_of(word));
  const std::uint64_t half = std::uint64_t{1} << (bits - 1);
  const std::uint64_t low = p.low + half;
  const std::uint64_t high = p.high + (low < half ? 1 : 0);
  return with_sign((high << (64 - bits)) | (low >> bits), (a < 0) != (word < 0));
}

// x 2^-bits rounded to the nearest; bits may be negative, and then the caller guarantees that it fits.
constexpr std::int64_t shift_right(std::int64_t x, int bits) {
  if (bits <= 0) return bits <= -64 ? 0 : static_cast<std::int64_t>(static_cast<std::uint64_t>(x) << -bits);
  if (bits >= 64) return 0;
  return (x >> bits) + ((x >> (bits - 1)) & 1);
}

// a b 2^-31 rounded to the nearest: one instruction (SMMULR and a shift) where the processor has it.
constexpr std::int32_t multiply31(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>((std::int64_t{a} * b + (std::int64_t{1} << 30)) >> 31);
}

// A polynomial in x of 31 fractional bits, by Horner's rule; the result has the format of the coefficients.
// Intermediate factors have to stay within 2^30, so that twice a factor is a word and the rounded product one
// instruction.
template <std::size_t Size>
constexpr std::int32_t polynomial(const std::int32_t (&coefficients)[Size], std::int32_t x) {
  std::int32_t sum = coefficients[Size - 1];
  for (std::size_t n = Size - 1; n > 0; --n)
    sum = add_high(coefficients[n - 1], static_cast<std::int32_t>(static_cast<std::uint32_t>(sum) << 1), x);
  return sum;
}

template <class T>
constexpr T limited(T x, T low, T high) {
  return x < low ? low : x > high ? high : x;
}
// x limited to -limit to limit, which is not negative. Nearly every x is within, which one comparison shows.
constexpr std::int32_t limited_to(std::int32_t x, std::int32_t limit) {
  const auto most = static_cast<std::uint32_t>(limit);
  if (static_cast<std::uint32_t>(x) + most <= 2 * most) [[likely]]
    return x;
  return static_cast<std::int32_t>(x < 0 ? 0 - most : most);
}
constexpr std::int64_t limited_to(std::int64_t x, std::int64_t limit) {
  const auto most = static_cast<std::uint64_t>(limit);
  if (static_cast<std::uint64_t>(x) + most <= 2 * most) [[likely]]
    return x;
  return static_cast<std::int64_t>(x < 0 ? 0 - most : most);
}

}  // namespace flexspline::fixed
