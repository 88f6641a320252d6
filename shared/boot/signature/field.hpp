// Integers modulo p = 2^255 - 19, as RFC 8032 needs them. Written for size: loops over words of 32 bits, products of
// two words with two sums, which 64 bits hold. Times depend on values: all of them are public in a verification.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace flexspline::ed25519 {

inline constexpr std::size_t kWords = 8;
// The least significant word first.
using Words = std::array<std::uint32_t, kWords>;

constexpr Words words_of(std::span<const std::uint8_t, 32> bytes) {
  Words words{};
  for (std::size_t i = 0; i < bytes.size(); ++i) words[i / 4] |= std::uint32_t{bytes[i]} << (8 * (i % 4));
  return words;
}
constexpr std::array<std::uint8_t, 32> bytes_of(const Words& words) {
  std::array<std::uint8_t, 32> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(words[i / 4] >> (8 * (i % 4)));
  return bytes;
}
// a -= b. Returns the borrow.
constexpr std::uint32_t subtract(Words& a, const Words& b) {
  std::uint32_t borrow = 0;
  for (std::size_t i = 0; i < kWords; ++i) {
    const std::uint64_t d = std::uint64_t{a[i]} - b[i] - borrow;
    a[i] = static_cast<std::uint32_t>(d);
    borrow = static_cast<std::uint32_t>(d >> 63);
  }
  return borrow;
}
// Whether a < b.
constexpr bool is_less(Words a, const Words& b) {
  return subtract(a, b) != 0;
}

// One of the numbers below 2^256 that stand for it.
struct Field {
  Words words{};

  static constexpr Words kPrime{0xFFFFFFED, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF,
                                0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0x7FFFFFFF};

  friend constexpr Field operator+(const Field& a, const Field& b) {
    Field sum;
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < kWords; ++i) {
      carry += std::uint64_t{a.words[i]} + b.words[i];
      sum.words[i] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    sum.fold(static_cast<std::uint32_t>(carry));
    return sum;
  }
  // 2^256 is 38 modulo p. A second borrow needs a difference of -38 or more, and so leaves none.
  friend constexpr Field operator-(const Field& a, const Field& b) {
    Field difference = a;
    std::uint32_t borrow = subtract(difference.words, b.words);
    for (int round = 0; round < 2 && borrow != 0; ++round) borrow = subtract(difference.words, {38});
    return difference;
  }
  friend constexpr Field operator*(const Field& a, const Field& b) {
    std::array<std::uint32_t, 16> product{};  // 2 kWords, as a number for cppcheck
    for (std::size_t i = 0; i < kWords; ++i) {
      std::uint32_t carry = 0;
      for (std::size_t j = 0; j < kWords; ++j) {
        const std::uint64_t t = std::uint64_t{a.words[i]} * b.words[j] + product[i + j] + carry;
        product[i + j] = static_cast<std::uint32_t>(t);
        carry = static_cast<std::uint32_t>(t >> 32);
      }
      product[i + kWords] = carry;
    }
    Field result;
    std::uint32_t carry = 0;
    for (std::size_t i = 0; i < kWords; ++i) {
      const std::uint64_t t = std::uint64_t{product[i + kWords]} * 38 + product[i] + carry;
      result.words[i] = static_cast<std::uint32_t>(t);
      carry = static_cast<std::uint32_t>(t >> 32);
    }
    result.fold(carry);
    return result;
  }
  friend constexpr bool operator==(const Field& a, const Field& b) { return a.canonical() == b.canonical(); }
  constexpr bool is_zero() const { return canonical() == Words{}; }
  constexpr bool is_odd() const { return (canonical()[0] & 1) != 0; }
  // Below p.
  constexpr Words canonical() const {
    Words least = words;
    // At most twice: 2^256 is 2 p + 38.
    for (int round = 0; round < 2 && !is_less(least, kPrime); ++round) subtract(least, kPrime);
    return least;
  }
  constexpr Field squared(std::size_t times) const {
    Field power = *this;
    for (; times > 0; --times) power = power * power;
    return power;
  }
  // To the power of 2^250 - 1, with which both powers below begin. x(n), to the power of 2^n - 1, gives
  // x(2 n) = x(n)^(2^n) x(n) and x(n + 1) = x(n)^2 x(1); n takes the leading bits of 250.
  constexpr Field power_of_250_ones() const {
    Field x = *this;
    for (std::size_t n = 1; n != 250;) {
      x = x.squared(n) * x;
      n *= 2;
      if (n == 2 || n == 6 || n == 14 || n == 30 || n == 124) {
        x = x.squared(1) * *this;
        ++n;
      }
    }
    return x;
  }
  // To the power of p - 2 = (2^250 - 1) 2^5 + 11. Zero for zero.
  constexpr Field inverse() const {
    const Field two = squared(1);
    return power_of_250_ones().squared(5) * two.squared(2) * two * *this;
  }
  // To the power of (p - 5) / 8 = (2^250 - 1) 4 + 1.
  constexpr Field root_power() const { return power_of_250_ones().squared(2) * *this; }

 private:
  // Adds a carry of 2^256; a second one leaves a small number, which gives no third.
  constexpr void fold(std::uint32_t carry) {
    for (int round = 0; round < 2 && carry != 0; ++round) {
      std::uint64_t sum = std::uint64_t{carry} * 38;
      for (std::uint32_t& word : words) {
        sum += word;
        word = static_cast<std::uint32_t>(sum);
        sum >>= 32;
      }
      carry = static_cast<std::uint32_t>(sum);
    }
  }
};

}  // namespace flexspline::ed25519
