// Integers modulo the order of the base point, L = 2^252 + 27742317777372353535851937790883648493 (RFC 8032, 5.1).
#pragma once

#include <span>

#include "shared/boot/signature/field.hpp"

namespace flexspline::ed25519 {

inline constexpr Words kOrder{0x5cf5d3ed, 0x5812631a, 0xa2f79cd6, 0x14def9de, 0, 0, 0, 0x10000000};

constexpr bool bit_of(const Words& words, std::size_t i) {
  return (words[i / 32] >> (i % 32) & 1) != 0;
}
// A number of any length, the least significant byte first, modulo L: bit for bit, by doubling and subtraction.
constexpr Words modulo_order(std::span<const std::uint8_t> bytes) {
  Words rest{};
  for (std::size_t i = 8 * bytes.size(); i-- > 0;) {
    std::uint32_t carry = bytes[i / 8] >> (i % 8) & 1U;
    for (std::uint32_t& word : rest) {
      const std::uint32_t next = word >> 31;
      word = word << 1 | carry;
      carry = next;
    }
    if (!is_less(rest, kOrder)) subtract(rest, kOrder);
  }
  return rest;
}

}  // namespace flexspline::ed25519
