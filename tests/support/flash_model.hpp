// A NOR flash of two sectors (or as many as are wanted) whose power can be cut at any of its operations: before it,
// inside it or after it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>

#include "shared/storage/flash_port.hpp"

namespace flexspline::tests {

struct PowerCut {};

enum class CutAt { before, inside, after };

// What outlasts a power cut.
template <std::size_t kBytes, std::size_t kCount = storage::kSectors>
struct FlashCells {
  alignas(8) std::array<std::array<std::uint8_t, kBytes>, kCount> sectors;
  // Where it is wanted: bits that an operation was cut in are weak, and read one way or the other at each start until
  // they are erased or programmed whole.
  bool weakens = false;
  std::array<std::array<std::uint8_t, kBytes>, kCount> weak{};
  FlashCells() {
    for (auto& sector : sectors) sector.fill(0xFF);
  }
};

// The memory as the processor sees it, from one start to the next.
template <std::size_t kBytes, std::size_t kCount = storage::kSectors>
class FlashModel {
 public:
  static constexpr std::size_t kSectorBytes = kBytes;

  explicit FlashModel(FlashCells<kBytes, kCount>& cells, std::uint64_t seed = 1) : cells_(cells), random_(seed) {
    if (!cells.weakens) return;
    for (std::size_t s = 0; s < kCount; ++s)
      for (std::size_t i = 0; i < kBytes; ++i)
        if (const std::uint8_t mask = cells.weak[s][i]; mask != 0)
          cells.sectors[s][i] = static_cast<std::uint8_t>((cells.sectors[s][i] & ~mask) | (random_() & mask));
  }
  // The power goes at the operation of this number, from zero.
  void cut(std::size_t operation, CutAt where) {
    cut_ = static_cast<long>(operation);
    where_ = where;
  }
  std::size_t operations() const { return operations_; }
  void fail_from_now() { fails_ = true; }

  bool erase(std::size_t sector) {
    auto& bytes = cells_.sectors[sector];
    if (!begin_operation()) return false;
    if (cut_here(CutAt::inside)) {
      // How far it came: a few cells, garbage throughout or in part of the words, or all but a few cells.
      const auto how = random_() % 4;
      for (std::size_t i = 0; i < bytes.size(); ++i) {
        const auto noise = static_cast<std::uint8_t>(random_());
        const std::uint8_t whole = bytes[i];
        if (how == 0 && random_() % 64 == 0) bytes[i] |= noise;
        if (how == 1) bytes[i] = noise;
        if (how == 2 && (i / 4) % 3 != 0) bytes[i] = noise;
        if (how == 3) bytes[i] = random_() % 256 == 0 ? noise : 0xFF;
        // Not the bits that were erased before; near its begin and its end those of a few cells.
        const bool reached = how == 1 || how == 2 || (how == 0 ? bytes[i] != whole : bytes[i] != 0xFF);
        if (cells_.weakens && reached)
          cells_.weak[sector][i] = static_cast<std::uint8_t>(~whole | cells_.weak[sector][i]);
      }
      throw PowerCut{};
    }
    bytes.fill(0xFF);
    cells_.weak[sector].fill(0);
    return end_operation();
  }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    std::uint8_t* at = cells_.sectors[sector].data() + 4 * word;
    if (!begin_operation()) return false;
    std::uint32_t now = 0;
    std::memcpy(&now, at, 4);
    std::uint32_t then = now & value;
    if (cut_here(CutAt::inside)) {
      std::uint32_t missing = now & static_cast<std::uint32_t>(random_());  // some of the bits, perhaps none or all
      std::uint32_t weak = now & ~value;
      if (cells_.weakens) {
        // Near its begin or its end a few bits are weak, and the others as before or as wanted.
        const auto few = static_cast<std::uint32_t>(random_() & random_() & random_());
        const auto how = random_() % 3;
        if (how != 0) weak &= few;
        if (how == 1) missing = now;
        if (how == 2) missing = 0;
        weaken(sector, word, weak);
      }
      then |= missing;
      std::memcpy(at, &then, 4);
      throw PowerCut{};
    }
    std::memcpy(at, &then, 4);
    if (cells_.weakens) strengthen(sector, word, ~value);
    return end_operation();
  }
  std::span<const std::uint8_t> bytes(std::size_t sector) const { return cells_.sectors[sector]; }

 private:
  void weaken(std::size_t sector, std::size_t word, std::uint32_t bits) {
    for (std::size_t i = 0; i < 4; ++i) cells_.weak[sector][4 * word + i] |= static_cast<std::uint8_t>(bits >> (8 * i));
  }
  // What is programmed whole is a zero for good.
  void strengthen(std::size_t sector, std::size_t word, std::uint32_t bits) {
    for (std::size_t i = 0; i < 4; ++i)
      cells_.weak[sector][4 * word + i] &= static_cast<std::uint8_t>(~(bits >> (8 * i)));
  }
  bool cut_here(CutAt where) const { return cut_ == static_cast<long>(operations_) && where_ == where; }
  bool begin_operation() {
    if (cut_here(CutAt::before)) throw PowerCut{};
    return !fails_;
  }
  bool end_operation() {
    if (cut_here(CutAt::after)) throw PowerCut{};
    ++operations_;
    return true;
  }

  FlashCells<kBytes, kCount>& cells_;
  std::mt19937_64 random_;
  std::size_t operations_ = 0;
  long cut_ = -1;
  CutAt where_ = CutAt::before;
  bool fails_ = false;
};

}  // namespace flexspline::tests
