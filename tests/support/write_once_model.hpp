// A flash memory of double words with error correction, each written once after an erase, whose power can be cut at any
// of its operations. Written again with anything but zeros it reports an error and is left as it is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

#include "shared/storage/write_once_flash.hpp"
#include "tests/support/flash_model.hpp"

namespace flexspline::tests {

// What outlasts a power cut.
template <std::size_t kBytes, std::size_t kCount = storage::kSectors>
struct OnceCells {
  struct Cell {
    std::uint64_t value = storage::kErasedDoubleWord;
    bool readable = true;
    // An operation was cut in it: where it is wanted it reads in one of these ways at each start.
    bool weak = false;
    std::uint64_t was = 0;
    std::uint64_t wanted = 0;
  };
  std::array<std::array<Cell, kBytes / 8>, kCount> sectors{};
  bool weakens = false;
};

template <std::size_t kBytes, std::size_t kCount = storage::kSectors>
class OnceModel {
 public:
  static constexpr std::size_t kSectorBytes = kBytes;
  using Cells = OnceCells<kBytes, kCount>;
  using Cell = typename Cells::Cell;

  explicit OnceModel(Cells& cells, std::uint64_t seed = 1) : cells_(cells), random_(seed) {
    for (auto& sector : cells.sectors)
      for (Cell& c : sector)
        if (c.weak) draw_contents(c);
  }
  void cut(std::size_t operation, CutAt where) {
    cut_ = static_cast<long>(operation);
    where_ = where;
  }
  std::size_t operations() const { return operations_; }
  std::size_t refused() const { return refused_; }  // second writes

  bool erase(std::size_t sector) {
    begin_operation();
    for (Cell& c : cells_.sectors[sector]) {
      if (cut_here(CutAt::inside))
        interrupt(c, storage::kErasedDoubleWord);
      else
        c = {};
    }
    if (cut_here(CutAt::inside)) throw PowerCut{};
    return end_operation();
  }
  bool program(std::size_t sector, std::size_t at, std::uint64_t value) {
    begin_operation();
    Cell& c = cells_.sectors[sector][at];
    const bool is_erased = c.readable && c.value == storage::kErasedDoubleWord;
    if (!is_erased && value != 0) {
      ++refused_;
      return false;
    }
    if (cut_here(CutAt::inside)) {
      interrupt(c, value);
      throw PowerCut{};
    }
    c = {value};
    return end_operation();
  }
  bool read(std::size_t sector, std::size_t at, std::uint64_t& value) const {
    const Cell& c = cells_.sectors[sector][at];
    value = c.value;
    return c.readable;
  }

 private:
  // Near its begin it reads as before, near its end as wanted, and cannot be corrected between. Where no bit changes,
  // nothing does.
  void interrupt(Cell& c, std::uint64_t wanted) {
    if (c.readable && c.value == wanted) return;
    const std::uint64_t was = c.readable ? c.value : random_();
    c.weak = cells_.weakens;
    c.was = was;
    c.wanted = wanted;
    draw_contents(c);
  }
  void draw_contents(Cell& c) {
    const auto how = random_() % 3;
    c.readable = how != 0;
    c.value = how == 0 ? random_() : how == 1 ? c.was : c.wanted;
  }
  bool cut_here(CutAt where) const { return cut_ == static_cast<long>(operations_) && where_ == where; }
  void begin_operation() {
    if (cut_here(CutAt::before)) throw PowerCut{};
  }
  bool end_operation() {
    if (cut_here(CutAt::after)) throw PowerCut{};
    ++operations_;
    return true;
  }

  Cells& cells_;
  std::mt19937_64 random_;
  std::size_t operations_ = 0;
  std::size_t refused_ = 0;
  long cut_ = -1;
  CutAt where_ = CutAt::before;
};

// As a store or an update sees it, from one start to the next.
template <std::size_t kBytes, std::size_t kCount = storage::kSectors>
class OnceFlash {
 public:
  static constexpr std::size_t kSectorBytes = kBytes;
  static constexpr bool kWriteOnce = true;
  explicit OnceFlash(OnceCells<kBytes, kCount>& cells, std::uint64_t seed = 1) : model_(cells, seed), flash_(model_) {}
  OnceFlash(const OnceFlash&) = delete;
  OnceFlash& operator=(const OnceFlash&) = delete;

  void cut(std::size_t operation, CutAt where) { model_.cut(operation, where); }
  std::size_t operations() const { return model_.operations(); }
  std::size_t refused() const { return model_.refused(); }
  bool erase(std::size_t sector) { return flash_.erase(sector); }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    return flash_.program(sector, word, value);
  }
  bool flush() { return flash_.flush(); }
  std::span<const std::uint8_t> bytes(std::size_t sector) const { return flash_.bytes(sector); }

 private:
  using Model = OnceModel<kBytes, kCount>;
  Model model_;
  storage::WriteOnceFlash<Model, kCount> flash_;
};

}  // namespace flexspline::tests
