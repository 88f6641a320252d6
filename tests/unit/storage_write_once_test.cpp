// The parameter store on a memory of double words with error correction, each written once after an erase: the power is
// cut at every operation, and again at every operation of the next try.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <vector>

#include "shared/storage/parameter_store.hpp"
#include "tests/support/write_once_model.hpp"

namespace flexspline::storage_write_once_test {
namespace {

using storage::StoreError;
using tests::CutAt;
using tests::PowerCut;
using Bytes = std::vector<std::uint8_t>;
constexpr std::size_t kSector = 768;
using Cells = tests::OnceCells<kSector>;
using Model = tests::OnceModel<kSector>;
using Flash = tests::OnceFlash<kSector>;
using Store = storage::ParameterStore<Flash>;

TEST(WriteOnceFlash, TakesADoubleWordOnceAfterAnEraseAndThenOnlyZeros) {
  Cells cells;
  Model model(cells);
  storage::WriteOnceFlash<Model> flash(model);
  ASSERT_TRUE(flash.program(0, 4, 0x11111111));
  EXPECT_EQ(model.operations(), 0U) << "it waits for its neighbour";
  ASSERT_TRUE(flash.program(0, 5, 0x22222222));
  EXPECT_EQ(cells.sectors[0][2].value, 0x2222222211111111U);
  EXPECT_TRUE(flash.program(0, 4, 0x11111111)) << "nothing changes";
  EXPECT_EQ(model.operations(), 1U);
  EXPECT_FALSE(flash.program(0, 4, 0x11110000)) << "clears bits, as a memory without error correction can";
  EXPECT_EQ(model.refused(), 0U) << "the memory is not even asked";
  EXPECT_TRUE(flash.program(0, 5, 0));
  EXPECT_EQ(cells.sectors[0][2].value, 0U);
  ASSERT_TRUE(flash.erase(0));
  EXPECT_TRUE(flash.program(0, 5, 0x33333333));
  EXPECT_EQ(cells.sectors[0][2].value, 0x33333333FFFFFFFFU);
}

TEST(WriteOnceFlash, AWordWhoseNeighbourIsLeftOutIsWrittenBeforeTheNextDoubleWord) {
  Cells cells;
  Model model(cells);
  storage::WriteOnceFlash<Model> flash(model);
  ASSERT_TRUE(flash.program(1, 0, 7));
  ASSERT_TRUE(flash.program(0, 9, 8));
  EXPECT_EQ(cells.sectors[1][0].value, 0xFFFFFFFF00000007U);
  EXPECT_EQ(cells.sectors[0][4].value, 0x00000008FFFFFFFFU);
}

TEST(WriteOnceFlash, WhatCannotBeCorrectedReadsAsNeitherErasedNorZero) {
  Cells cells;
  cells.sectors[0][3] = {0, false};
  Model model(cells);
  const storage::WriteOnceFlash<Model> flash(model);
  for (std::size_t i = 24; i < 32; i += 4) {
    const auto bytes = flash.bytes(0).subspan(i, 4);
    EXPECT_TRUE(std::any_of(bytes.begin(), bytes.end(), [](auto b) { return b != 0xFF; }));
    EXPECT_TRUE(std::any_of(bytes.begin(), bytes.end(), [](auto b) { return b != 0; }));
  }
}

// A block names itself in its first byte; an odd number of words.
Bytes block_named(char name) {
  Bytes bytes(42);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(name + i * i);
  return bytes;
}
std::uint32_t validate(std::span<const std::uint8_t> bytes) {
  return !bytes.empty() && std::ranges::equal(bytes, block_named(static_cast<char>(bytes[0]))) ? 0 : 1;
}
char name_of(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return '-';
  EXPECT_EQ(validate(bytes), 0U);
  return static_cast<char>(bytes[0]);
}

using Action = std::function<bool(Store&)>;
Action storing(char name) {
  return [name](Store& store) {
    const Bytes bytes = block_named(name);
    std::uint32_t reason = 0;
    return store.begin(bytes.size(), model::crc32(bytes)) == StoreError::none &&
           store.write(0, bytes) == StoreError::none && store.commit(validate, reason) == StoreError::none;
  };
}
bool restore(Store& store) {
  std::uint32_t reason = 0;
  return store.restore(validate, reason) == StoreError::none;
}

struct Case {
  const char* what;
  std::vector<Action> before;
  Action act;
  char from, to;  // active before and after
};
std::vector<Case> cases() {
  return {{"first commit", {}, storing('a'), '-', 'a'},
          {"second commit", {storing('a')}, storing('b'), 'a', 'b'},
          {"third commit", {storing('a'), storing('b')}, storing('c'), 'b', 'c'},
          {"restore", {storing('a'), storing('b')}, restore, 'b', 'a'},
          {"commit after a restore", {storing('a'), storing('b'), restore}, storing('c'), 'a', 'c'}};
}

// Whether the power was cut in it. All state is built anew.
bool act_cut(Cells& cells, const Action& act, std::size_t operation, CutAt where, std::uint64_t seed) {
  Flash flash(cells, seed);
  Store store(flash);
  store.boot(validate);
  flash.cut(operation, where);
  try {
    EXPECT_TRUE(act(store));
  } catch (const PowerCut&) {
    EXPECT_EQ(flash.refused(), 0U);
    return true;
  }
  EXPECT_EQ(flash.refused(), 0U) << "a second write of a double word";
  return false;
}
constexpr std::size_t kNever = 10'000;
void act(Cells& cells, const Action& action) {
  ASSERT_FALSE(act_cut(cells, action, kNever, CutAt::before, 1));
}
char active_in(Cells& cells) {
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  EXPECT_EQ(flash.operations(), 0U) << "a start writes nothing";
  return name_of(store.active());
}

constexpr CutAt kWheres[] = {CutAt::before, CutAt::inside, CutAt::after};

// The old block or the new one, and what was wanted works at the next try; returns the number of cuts in that.
std::size_t expect_old_or_new(const Cells& cells, const Case& c, bool cut_again) {
  Cells now = cells;
  const char active = active_in(now);
  EXPECT_TRUE(active == c.from || active == c.to) << c.what << ": " << active;
  if (active == c.to) return 0;
  std::size_t cuts = 0;
  for (std::size_t at = 0; cut_again; ++at) {
    bool was_cut = false;
    for (const CutAt where : kWheres) {
      Cells twice = now;
      was_cut = act_cut(twice, c.act, at, where, 31 * at) || was_cut;
      cuts += expect_old_or_new(twice, c, false) + 1;
    }
    if (!was_cut) break;
  }
  act(now, c.act);
  EXPECT_EQ(active_in(now), c.to) << c.what;
  return cuts;
}

TEST(StoreOnWriteOnceFlash, EveryPowerCutAndEveryPairLeavesACompleteOldOrNewBlock) {
  std::size_t cuts = 0, pairs = 0;
  for (const Case& c : cases()) {
    Cells prepared;
    for (const Action& action : c.before) act(prepared, action);
    ASSERT_EQ(active_in(prepared), c.from);
    bool was_cut = true;
    for (std::size_t at = 0; was_cut; ++at) {
      was_cut = false;
      for (const CutAt where : kWheres)
        for (std::uint64_t seed = 1; seed <= (where == CutAt::inside ? 20U : 1U); ++seed) {
          Cells cells = prepared;
          if (!act_cut(cells, c.act, at, where, seed)) continue;
          was_cut = true;
          ++cuts;
          pairs += expect_old_or_new(cells, c, seed <= 3);
        }
    }
  }
  std::printf("power cuts on double words that are written once: %zu, and %zu pairs\n", cuts, pairs);
  EXPECT_GT(cuts, 400U);
  EXPECT_GT(pairs, 3000U);
}

TEST(StoreOnWriteOnceFlash, TakesManyBlocksAndRestoresUntilItsSlotsAreUsed) {
  Cells cells;
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  for (int k = 0; k < 500; ++k) {
    ASSERT_TRUE(storing(k % 2 == 0 ? 'a' : 'b')(store)) << k;
    if (k > 0 && k % 3 == 0) {
      ASSERT_TRUE(restore(store)) << k;
    }
  }
  std::size_t restores = 0;
  while (restore(store)) ++restores;
  EXPECT_GE(restores, 20U);
  EXPECT_TRUE(storing('c')(store));
  EXPECT_EQ(active_in(cells), 'c');
  EXPECT_EQ(flash.refused(), 0U);
}

}  // namespace
}  // namespace flexspline::storage_write_once_test
