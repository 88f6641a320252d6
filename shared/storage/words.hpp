// Bytes as the words of a flash memory, for what stores blocks and images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/storage/flash_port.hpp"

namespace flexspline::storage {

// Calls put(number, word) for each word of a chunk, in order, as long as it returns true; the last one is filled with
// ones. Returns whether it always did.
template <class Put>
constexpr bool for_each_word(std::span<const std::uint8_t> chunk, Put&& put) {
  for (std::size_t i = 0; i < chunk.size(); i += 4) {
    std::uint32_t word = kErasedWord;
    for (std::size_t b = 0; b < 4 && i + b < chunk.size(); ++b) {
      word &= ~(std::uint32_t{0xFF} << (8 * b));
      word |= std::uint32_t{chunk[i + b]} << (8 * b);
    }
    if (!put(i / 4, word)) return false;
  }
  return true;
}
constexpr bool is_blank(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes)
    if (byte != 0xFF) return false;
  return true;
}

}  // namespace flexspline::storage
