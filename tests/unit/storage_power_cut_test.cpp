// The power is cut at every operation of the flash memory, before, inside and after it, and again at every operation of
// what the next start tries; all state is built anew at each start.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "shared/storage/parameter_store.hpp"
#include "tests/support/flash_model.hpp"

namespace flexspline::storage_power_cut_test {
namespace {

using storage::StoreError;
using storage::StoreState;
using tests::CutAt;
using tests::PowerCut;
using Bytes = std::vector<std::uint8_t>;
constexpr std::size_t kSector = 512;
using Cells = tests::FlashCells<kSector>;
using Flash = tests::FlashModel<kSector>;
using Store = storage::ParameterStore<Flash>;

// A block names itself in its first byte; the others follow from it.
Bytes block_named(char name, std::size_t size = 42) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(name + i * i);
  return bytes;
}
std::uint32_t validate(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 8) return 1;
  return std::ranges::equal(bytes, block_named(static_cast<char>(bytes[0]), bytes.size())) ? 0 : 2;
}

bool store_block(Store& store, const Bytes& bytes) {
  if (store.begin(bytes.size(), model::crc32(bytes)) != StoreError::none) return false;
  for (std::size_t at = 0; at < bytes.size(); at += 16) {
    const std::size_t size = std::min<std::size_t>(16, bytes.size() - at);
    if (store.write(at, std::span(bytes).subspan(at, size)) != StoreError::none) return false;
  }
  std::uint32_t reason = 0;
  return store.commit(validate, reason) == StoreError::none;
}
bool restore(Store& store) {
  std::uint32_t reason = 0;
  return store.restore(validate, reason) == StoreError::none;
}

// The name of the active block, '-' where there is none. Whatever is given out has to be whole.
char name_of(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return '-';
  EXPECT_EQ(validate(bytes), 0U);
  return static_cast<char>(bytes[0]);
}

using Action = std::function<bool(Store&)>;
struct Case {
  const char* what;
  std::function<void(Cells&)> prepare;
  Action act;
  char before;  // active before and after
  char after;
  std::size_t behind = 0;  // operations behind the one that decides
};

void on(Cells& cells, const Action& action) {
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  ASSERT_TRUE(action(store));
}
Action storing(char name) {
  return [name](Store& store) { return store_block(store, block_named(name)); };
}

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"first commit", [](Cells&) {}, storing('a'), '-', 'a'},
      {"second commit", [](Cells& c) { on(c, storing('a')); }, storing('b'), 'a', 'b'},
      {"third commit",
       [](Cells& c) {
         on(c, storing('a'));
         on(c, storing('b'));
       },
       storing('c'), 'b', 'c'},
      {"restore",
       [](Cells& c) {
         on(c, storing('a'));
         on(c, storing('b'));
       },
       restore, 'b', 'a', 2},
      {"restore of a restore",
       [](Cells& c) {
         on(c, storing('a'));
         on(c, storing('b'));
         on(c, restore);
       },
       restore, 'a', 'b', 2},
      {"commit after a restore",
       [](Cells& c) {
         on(c, storing('a'));
         on(c, storing('b'));
         on(c, restore);
       },
       storing('c'), 'a', 'c'},
  };
  return all;
}

std::size_t operations_of(const Case& c) {
  Cells cells;
  c.prepare(cells);
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  EXPECT_TRUE(c.act(store));
  return flash.operations();
}

// Starts on these cells and acts, with the power cut there. Returns whether it was cut.
bool act_cut(Cells& cells, const Action& act, std::size_t operation, CutAt where, std::uint64_t seed) {
  Flash flash(cells, seed);
  Store store(flash);
  store.boot(validate);
  flash.cut(operation, where);
  try {
    act(store);
  } catch (const PowerCut&) {
    return true;
  }
  return false;
}
// A start after a cut: old or new, whole, and said to be so.
char active_after_start(Cells& cells, const Case& c) {
  Flash flash(cells);
  Store store(flash);
  const StoreState state = store.boot(validate);
  const char name = name_of(store.active());
  EXPECT_TRUE(name == c.before || name == c.after) << c.what << ": " << name;
  EXPECT_EQ(state, name == '-' ? StoreState::empty : StoreState::good) << c.what;
  name_of(store.previous());
  EXPECT_EQ(flash.operations(), 0U) << "a start writes nothing";
  return name;
}
// What the user wanted works at the next try.
void expect_it_works_now(const Cells& cells, const Case& c, char active) {
  Cells copy = cells;
  if (active != c.after) on(copy, c.act);
  Flash flash(copy);
  Store store(flash);
  EXPECT_EQ(store.boot(validate), StoreState::good);
  EXPECT_EQ(name_of(store.active()), c.after) << c.what;
  if (c.before != '-') {
    EXPECT_EQ(name_of(store.previous()), c.before) << c.what;
  }
}

constexpr CutAt kWheres[] = {CutAt::before, CutAt::inside, CutAt::after};

TEST(ParameterStore, EveryPowerCutOfACommitOrRestoreLeavesACompleteOldOrNewBlock) {
  std::size_t cuts = 0;
  for (const Case& c : cases()) {
    Cells prepared;
    c.prepare(prepared);
    const std::size_t operations = operations_of(c);
    for (std::size_t at = 0; at < operations; ++at)
      for (const CutAt where : kWheres)
        for (std::uint64_t seed = 1; seed <= (where == CutAt::inside ? 20U : 1U); ++seed) {
          Cells cells = prepared;
          ASSERT_TRUE(act_cut(cells, c.act, at, where, seed));
          ++cuts;
          const char active = active_after_start(cells, c);
          if (at + 1 + c.behind < operations) {
            EXPECT_EQ(active, c.before) << c.what << ": one word decides";
          }
          if (at + c.behind >= operations || (at + 1 + c.behind == operations && where == CutAt::after)) {
            EXPECT_EQ(active, c.after) << c.what;
          }
          expect_it_works_now(cells, c, active);
        }
    ASSERT_FALSE(act_cut(prepared, c.act, operations, CutAt::before, 1)) << "there are no more operations";
  }
  std::printf("power cuts, one at a time: %zu\n", cuts);
  EXPECT_GT(cuts, 800U);
}

TEST(ParameterStore, EveryPairOfPowerCutsLeavesACompleteOldOrNewBlock) {
  std::size_t pairs = 0;
  for (const Case& c : cases()) {
    Cells prepared;
    c.prepare(prepared);
    const std::size_t operations = operations_of(c);
    for (std::size_t at = 0; at < operations; ++at)
      for (const CutAt where : kWheres) {
        Cells once = prepared;
        ASSERT_TRUE(act_cut(once, c.act, at, where, 100 + at));
        const char active = active_after_start(once, c);
        if (active == c.after) continue;  // nothing is tried again
        for (std::size_t second = 0; second < operations + 1; ++second)
          for (const CutAt second_where : kWheres) {
            Cells twice = once;
            if (!act_cut(twice, c.act, second, second_where, 1000 * at + second)) continue;
            ++pairs;
            expect_it_works_now(twice, c, active_after_start(twice, c));
          }
      }
  }
  std::printf("power cuts, in pairs: %zu\n", pairs);
  EXPECT_GT(pairs, 5000U);
}

// The user changes his mind in between: a commit is cut, then a restore, and the reverse.
TEST(ParameterStore, ACutCommitFollowedByACutRestoreLeavesOneOfTheBlocksThatWereThere) {
  Cells prepared;
  on(prepared, storing('a'));
  on(prepared, storing('b'));
  std::size_t pairs = 0;
  const Action actions[] = {storing('c'), restore};
  for (const Action& first : actions)
    for (const Action& then : actions)
      for (std::size_t at = 0; at < 20; ++at)
        for (const CutAt where : kWheres)
          for (std::size_t second = 0; second < 20; ++second)
            for (const CutAt second_where : kWheres) {
              Cells cells = prepared;
              act_cut(cells, first, at, where, at);
              act_cut(cells, then, second, second_where, second);
              ++pairs;
              Flash flash(cells);
              Store store(flash);
              ASSERT_EQ(store.boot(validate), StoreState::good);
              const char name = name_of(store.active());
              ASSERT_TRUE(name == 'a' || name == 'b' || name == 'c');
              ASSERT_TRUE(store_block(store, block_named('d')));
              ASSERT_EQ(name_of(store.active()), 'd');
            }
  std::printf("power cuts, commit and restore mixed: %zu\n", pairs);
}

// The newest block that rots is distinguished from one that was never committed.
TEST(ParameterStore, DamagedBlocksAreSaidToBeDamagedAndNeverReplacedSilently) {
  Cells prepared;
  on(prepared, storing('a'));
  on(prepared, storing('b'));
  const auto state_with = [&](std::initializer_list<std::size_t> sectors, char expected) {
    Cells cells = prepared;
    for (const std::size_t s : sectors) cells.sectors[s][Store::kHeaderBytes + 5] ^= 0x10;
    Flash flash(cells);
    Store store(flash);
    const StoreState state = store.boot(validate);
    EXPECT_EQ(name_of(store.active()), expected);
    return state;
  };
  EXPECT_EQ(state_with({}, 'b'), StoreState::good);
  EXPECT_EQ(state_with({1}, 'a'), StoreState::fell_back);
  EXPECT_EQ(state_with({0}, 'b'), StoreState::good);
  EXPECT_EQ(state_with({0, 1}, '-'), StoreState::damaged);
}

TEST(ParameterStore, BlocksThatTheValidatorRefusesAreNeverActive) {
  Cells cells;
  on(cells, storing('a'));
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  Bytes wrong = block_named('b');
  wrong[7] ^= 1;
  ASSERT_EQ(store.begin(wrong.size(), model::crc32(wrong)), StoreError::none);
  ASSERT_EQ(store.write(0, wrong), StoreError::none);
  std::uint32_t reason = 0;
  EXPECT_EQ(store.commit(validate, reason), StoreError::invalid);
  EXPECT_EQ(reason, 2U);
  EXPECT_EQ(name_of(store.active()), 'a');
  // A block that a later image refuses is not restored, and the newest is not passed over without a word.
  on(cells, storing('b'));
  Flash again(cells);
  Store later(again);
  EXPECT_EQ(later.boot([](auto bytes) { return bytes[0] == 'b' ? 7U : 0U; }), StoreState::fell_back);
  EXPECT_EQ(name_of(later.active()), 'a');
}

TEST(ParameterStore, ChunksComeInOrderAndARepeatedOneIsTakenOnce) {
  Cells cells;
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  const Bytes bytes = block_named('a');
  const std::span all(bytes);
  std::uint32_t reason = 0;
  EXPECT_EQ(store.write(0, all), StoreError::not_begun);
  EXPECT_EQ(store.commit(validate, reason), StoreError::not_begun);
  EXPECT_EQ(store.begin(0, 0), StoreError::too_long);
  EXPECT_EQ(store.begin(Store::kCapacity + 1, 0), StoreError::too_long);
  ASSERT_EQ(store.begin(bytes.size(), model::crc32(bytes)), StoreError::none);
  EXPECT_EQ(store.write(16, all.subspan(16, 16)), StoreError::out_of_order);
  EXPECT_EQ(store.write(0, all.first(15)), StoreError::out_of_order);
  EXPECT_EQ(store.write(0, all.first(16)), StoreError::none);
  const std::size_t before = flash.operations();
  EXPECT_EQ(store.write(0, all.first(16)), StoreError::none);
  EXPECT_EQ(flash.operations(), before);
  EXPECT_EQ(store.write(0, all.subspan(1, 16)), StoreError::out_of_order) << "not what is staged";
  EXPECT_EQ(store.write(0, all.first(20)), StoreError::out_of_order) << "half of it is new";
  EXPECT_EQ(store.commit(validate, reason), StoreError::incomplete);
  EXPECT_EQ(store.write(16, all.subspan(16)), StoreError::none);
  EXPECT_EQ(store.write(44, all.first(4)), StoreError::out_of_order) << "beyond the end";
  EXPECT_EQ(store.commit(validate, reason), StoreError::none);
  EXPECT_EQ(store.sequence(), Store::sequence_after(0));
  // Another checksum than announced.
  ASSERT_EQ(store.begin(bytes.size(), 1), StoreError::none);
  ASSERT_EQ(store.write(0, all), StoreError::none);
  EXPECT_EQ(store.commit(validate, reason), StoreError::wrong_checksum);
  EXPECT_EQ(name_of(store.active()), 'a');
}

TEST(ParameterStore, AMemoryThatDoesNotTakeWhatIsWrittenIsReportedAndTheOldBlockStays) {
  Cells cells;
  on(cells, storing('a'));
  for (std::size_t good = 0; good < 3; ++good) {
    Flash flash(cells);
    Store store(flash);
    store.boot(validate);
    const Bytes bytes = block_named('b');
    if (good == 0) flash.fail_from_now();
    const StoreError begun = store.begin(bytes.size(), model::crc32(bytes));
    EXPECT_EQ(begun, good == 0 ? StoreError::flash : StoreError::none);
    if (good == 1) flash.fail_from_now();
    const StoreError written = store.write(0, bytes);
    if (good == 1) {
      EXPECT_EQ(written, StoreError::flash);
    }
    if (good == 2) flash.fail_from_now();
    std::uint32_t reason = 0;
    EXPECT_EQ(store.commit(validate, reason), good == 2 ? StoreError::flash : StoreError::not_begun);
    EXPECT_EQ(name_of(store.active()), 'a');
  }
}

// Whoever can write blocks cannot lock the store by writing many.
TEST(ParameterStore, TakesBlocksWithoutEndAndItsNumbersWrap) {
  Cells cells;
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  std::uint16_t before = 0;
  bool wrapped = false;
  for (int k = 0; k < 70'000; ++k) {
    const char name = k % 2 == 0 ? 'a' : 'b';
    ASSERT_TRUE(store_block(store, block_named(name, 8))) << k;
    // Each takes another number, a little later.
    const int ahead = store.sequence() - before;
    ASSERT_TRUE((ahead > 0 && ahead < 4) || ahead < -0xFF00) << k;
    wrapped = wrapped || ahead < 0;
    before = store.sequence();
    if (k < 65'000 && k % 1000 != 0) continue;
    // As after a start.
    Store again(flash);
    ASSERT_EQ(again.boot(validate), StoreState::good);
    ASSERT_EQ(name_of(again.active()), name) << k;
    ASSERT_EQ(again.sequence(), before);
  }
  EXPECT_TRUE(wrapped);
}

TEST(ParameterStore, RestoresGoBackAndForthUntilTheSlotsAreUsedUpAndACommitMakesRoom) {
  Cells cells;
  on(cells, storing('a'));
  on(cells, storing('b'));
  Flash flash(cells);
  Store store(flash);
  store.boot(validate);
  std::size_t times = 0;
  while (restore(store)) EXPECT_EQ(name_of(store.active()), ++times % 2 == 1 ? 'a' : 'b');
  EXPECT_EQ(times, 24U);  // 30 slots each: one taken by a commit, two by each restore, two left for the next block
  std::uint32_t reason = 0;
  EXPECT_EQ(store.restore(validate, reason), StoreError::worn);
  EXPECT_TRUE(store_block(store, block_named('c')));
  EXPECT_TRUE(restore(store) || name_of(store.active()) == 'c');
}

}  // namespace
}  // namespace flexspline::storage_power_cut_test
