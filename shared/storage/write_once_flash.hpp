// The port of a store or of an update's slots on a memory that is written in double words, once after each erase. All
// sectors have a copy in RAM, which everything is read from. A word at an even place waits for its neighbour: both are
// written together, the first one alone as soon as another double word is begun. So the memory is written in the order
// of the words.
//
// A double word that cannot be corrected reads as neither erased nor any valid number or check.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/storage/flash_port.hpp"

namespace flexspline::storage {

template <WriteOncePort Port, std::size_t kCount = kSectors>
class WriteOnceFlash {
 public:
  static constexpr std::size_t kSectorBytes = Port::kSectorBytes;
  static constexpr bool kWriteOnce = true;
  static_assert(kSectorBytes % 8 == 0);

  explicit constexpr WriteOnceFlash(Port& port) : port_(port) {
    for (std::size_t s = 0; s < kCount; ++s) read_sector(s);
  }

  constexpr bool erase(std::size_t sector) {
    const bool kept = waiting_.sector == sector || flush();
    waits_ = false;
    const bool good = port_.erase(sector);
    read_sector(sector);
    return kept && good;
  }
  constexpr bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    const Place place{sector, word / 2};
    if (place != waiting_ && !flush()) return false;
    const int shift = word % 2 == 0 ? 0 : 32;
    const std::uint64_t before = copy(place);
    if (waits_ || before == kErasedDoubleWord) {
      if (value == kErasedWord) return true;
      set_copy(place, before & (~(std::uint64_t{kErasedWord} << shift) | std::uint64_t{value} << shift));
      waits_ = true;
      waiting_ = place;
      return word % 2 == 0 || flush();
    }
    // It is used: nothing but zeros can be written, to both of its words; again where both are there, as an interrupted
    // write may have left them.
    const auto there = static_cast<std::uint32_t>(before >> shift);
    if (value == 0 && (there != 0 || before == 0)) return write(place, 0);
    return there == value;
  }
  constexpr bool flush() {
    if (!waits_) return true;
    waits_ = false;
    return write(waiting_, copy(waiting_));
  }
  // Of the copy.
  constexpr std::span<const std::uint8_t> bytes(std::size_t sector) const { return copy_[sector].bytes; }

 private:
  static constexpr std::uint64_t kUnreadable = 0x0001'0001'0001'0001;
  struct Place {
    std::size_t sector = 0;
    std::size_t at = 0;
    constexpr bool operator==(const Place&) const = default;
  };
  struct alignas(8) Copy {
    std::array<std::uint8_t, kSectorBytes> bytes{};
  };

  constexpr std::uint64_t copy(const Place& place) const {
    std::uint64_t value = 0;
    for (std::size_t i = 8; i-- > 0;) value = value << 8 | copy_[place.sector].bytes[8 * place.at + i];
    return value;
  }
  constexpr void set_copy(const Place& place, std::uint64_t value) {
    for (std::size_t i = 0; i < 8; ++i)
      copy_[place.sector].bytes[8 * place.at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
  constexpr void read_back(const Place& place) {
    std::uint64_t value = 0;
    set_copy(place, port_.read(place.sector, place.at, value) ? value : kUnreadable);
  }
  constexpr void read_sector(std::size_t sector) {
    for (std::size_t at = 0; at < kSectorBytes / 8; ++at) read_back({sector, at});
  }
  constexpr bool write(const Place& place, std::uint64_t value) {
    const bool good = port_.program(place.sector, place.at, value);
    read_back(place);
    return good && copy(place) == value;
  }

  Port& port_;
  std::array<Copy, kCount> copy_{};
  Place waiting_{};
  bool waits_ = false;
};

}  // namespace flexspline::storage
