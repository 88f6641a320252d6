// What the parameter store asks of a flash memory: two sectors of one size that can be erased apart from each other.
// Bits go from 1 to 0 when a word is programmed, and back only by erasing a whole sector.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace flexspline::storage {

inline constexpr std::size_t kSectors = 2;
inline constexpr std::uint32_t kErasedWord = 0xFFFFFFFF;

// Calls wait until the memory is done; an erase may take a second, and on a memory with one bank nothing runs from it
// meanwhile: the store erases only when its user says so, and the user sees to it that the drive is not armed.
template <class F>
concept FlashPort = requires(F flash, const F& memory, std::size_t sector, std::size_t word, std::uint32_t value) {
  { F::kSectorBytes } -> std::convertible_to<std::size_t>;  // a multiple of eight
  // False: the memory itself reported an error. What it did is read back in any case.
  { flash.erase(sector) } -> std::same_as<bool>;
  { flash.program(sector, word, value) } -> std::same_as<bool>;  // the word of that number in the sector
  // The whole sector where it can be read, from a multiple of eight on.
  { memory.bytes(sector) } -> std::same_as<std::span<const std::uint8_t>>;
};

}  // namespace flexspline::storage
