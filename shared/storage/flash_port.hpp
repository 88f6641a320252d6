// What the parameter store needs from a flash memory: two sectors of one size that can be erased independently.
// Programming a word changes bits from 1 to 0; only erasing a whole sector changes them back.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace flexspline::storage {

inline constexpr std::size_t kSectors = 2;
inline constexpr std::uint32_t kErasedWord = 0xFFFFFFFF;

// Calls wait until the memory is ready. An erase may take two seconds, during which nothing runs from a memory with one
// bank: the store erases only at its user's request, and the user makes sure that the drive is not armed.
template <class F>
concept FlashPort = requires(F flash, const F& memory, std::size_t sector, std::size_t word, std::uint32_t value) {
  { F::kSectorBytes } -> std::convertible_to<std::size_t>;  // a multiple of eight
  // False: the memory reported an error. The result is read back in any case.
  { flash.erase(sector) } -> std::same_as<bool>;
  { flash.program(sector, word, value) } -> std::same_as<bool>;  // the word of that number in the sector
  // The whole sector for reading, aligned to eight bytes.
  { memory.bytes(sector) } -> std::same_as<std::span<const std::uint8_t>>;
};

// Whether its words cannot be changed once they are written, but to zero (write_once_flash.hpp): then what is written
// in several steps has a double word for each of them.
template <class F>
inline constexpr bool kIsWriteOnce = requires {
  requires F::kWriteOnce;
};

// A memory in double words with error correction (STM32G4, STM32L4): each takes one value after an erase, and after
// that nothing but zeros. A power cut in that leaves what cannot be corrected. write_once_flash.hpp makes a FlashPort
// of it.
inline constexpr std::uint64_t kErasedDoubleWord = ~std::uint64_t{0};
template <class F>
concept WriteOncePort = requires(F flash, const F& memory, std::size_t sector, std::size_t at, std::uint64_t value,
                                 std::uint64_t& read) {
  { F::kSectorBytes } -> std::convertible_to<std::size_t>;  // a multiple of eight
  { flash.erase(sector) } -> std::same_as<bool>;
  { flash.program(sector, at, value) } -> std::same_as<bool>;  // the double word of that number in the sector
  // False: it cannot be corrected.
  { memory.read(sector, at, read) } -> std::same_as<bool>;
};

}  // namespace flexspline::storage
