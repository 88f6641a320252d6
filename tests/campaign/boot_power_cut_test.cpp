// The power is cut at every operation of the flash memory during an update, before, inside and after it, and again at
// every operation of what follows; all state is built anew at each start. Whatever happens, a whole image is started,
// and the next update works.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <set>
#include <vector>

#include "tests/support/update_bench.hpp"

namespace flexspline::boot_power_cut_test {
namespace {

using boot::Slot;
using boot::Start;
using tests::CutAt;
using tests::PowerCut;
using tests::SlotCells;
using tests::SlotFlash;
using tests::TestSlots;

// What the application of an image does: confirms itself, or does not come so far.
enum class Behaviour { does_well, hangs };
constexpr std::uint8_t kOld = 'a', kNew = 'b', kNext = 'c';

// The version of the image that is started, checked byte for byte; zero where there is none.
std::uint8_t name_of(const TestSlots& slots) {
  const auto image = slots.image(Slot::application);
  if (image.empty()) return 0;
  boot::ImageHeader header;
  EXPECT_EQ(boot::read_image(image, header), boot::ImageFinding::none);
  EXPECT_TRUE(std::ranges::equal(image, tests::image_named(header.version.major)));
  return header.version.major;
}

// A start of the boot loader and of the application that it finds, which confirms itself or hangs until the watchdog
// resets the drive. Returns whether another start is due.
bool run_once(SlotFlash& flash, Behaviour of_new, Start& start, std::uint8_t& name) {
  TestSlots slots(flash, tests::kTestBoard);
  start = slots.resume();
  name = start == Start::none ? 0 : name_of(slots);
  if (start != Start::trial) return false;
  if (of_new == Behaviour::hangs && name == kNew) return true;
  TestSlots application(flash, tests::kTestBoard);
  if (application.on_trial()) application.confirm();
  return false;
}

struct Case {
  const char* what;
  std::function<void(SlotCells&)> prepare;
  Behaviour of_new;
  std::uint8_t before, after;
};
void install(SlotCells& cells, std::uint8_t name) {
  SlotFlash flash(cells);
  TestSlots slots(flash, tests::kTestBoard);
  ASSERT_TRUE(tests::download(slots, tests::image_named(name)));
  Start start{};
  std::uint8_t runs = 0;
  run_once(flash, Behaviour::does_well, start, runs);
  ASSERT_EQ(runs, name);
}

const std::vector<Case>& cases() {
  const auto one = [](SlotCells& c) { install(c, kOld); };
  const auto two = [](SlotCells& c) {
    install(c, 'z');
    install(c, kOld);
  };
  static const std::vector<Case> all{
      {"the first update", one, Behaviour::does_well, kOld, kNew},
      {"a later update", two, Behaviour::does_well, kOld, kNew},
      {"an update that is taken back", one, Behaviour::hangs, kOld, kOld},
      {"a later update that is taken back", two, Behaviour::hangs, kOld, kOld},
  };
  return all;
}

// The whole update, from the download to an image that is confirmed or taken back. Throws PowerCut where it is cut.
void update(SlotFlash& flash, const Case& c) {
  TestSlots slots(flash, tests::kTestBoard);
  ASSERT_TRUE(tests::download(slots, tests::image_named(kNew)));
  Start start{};
  std::uint8_t name = 0;
  for (int i = 0; i < 6 && run_once(flash, c.of_new, start, name); ++i) {
  }
  ASSERT_EQ(name, c.after) << c.what;
}
// Starts until nothing is on trial, at most so often. False where it was cut.
bool run_on(SlotCells& cells, const Case& c, std::size_t cut, CutAt where, std::uint64_t seed, std::uint8_t& name) {
  SlotFlash flash(cells, seed);
  flash.cut(cut, where);
  Start start{};
  try {
    for (int i = 0; i < 6 && run_once(flash, c.of_new, start, name); ++i) {
    }
  } catch (const PowerCut&) {
    return false;
  }
  EXPECT_NE(start, Start::none) << c.what << ": nothing to start";
  return true;
}
constexpr std::size_t kNever = 1'000'000;

// After cuts: a whole image of those that may be is started, and then the next update works.
std::uint8_t expect_alive(const SlotCells& cells, const Case& c) {
  SlotCells copy = cells;
  std::uint8_t name = 0;
  EXPECT_TRUE(run_on(copy, c, kNever, CutAt::before, 1, name));
  EXPECT_TRUE(name == c.before || name == c.after) << c.what << ": starts " << int{name};
  install(copy, kNext);
  return name;
}
std::size_t operations_of(const Case& c, const SlotCells& prepared) {
  SlotCells cells = prepared;
  SlotFlash flash(cells);
  update(flash, c);
  return flash.operations();
}
// False where the power was not cut.
bool update_cut(SlotCells& cells, const Case& c, std::size_t cut, CutAt where, std::uint64_t seed) {
  SlotFlash flash(cells, seed);
  flash.cut(cut, where);
  try {
    update(flash, c);
  } catch (const PowerCut&) {
    return true;
  }
  return false;
}
constexpr CutAt kWheres[] = {CutAt::before, CutAt::inside, CutAt::after};

TEST(FirmwareUpdate, EveryPowerCutLeavesAWholeImageAndTheNextUpdateWorks) {
  std::size_t cuts = 0;
  for (const Case& c : cases()) {
    SlotCells prepared;
    c.prepare(prepared);
    const std::size_t operations = operations_of(c, prepared);
    std::set<std::uint8_t> seen;
    for (std::size_t at = 0; at < operations; ++at)
      for (const CutAt where : kWheres)
        for (std::uint64_t seed = 1; seed <= (where == CutAt::inside ? 4U : 1U); ++seed) {
          SlotCells cells = prepared;
          ASSERT_TRUE(update_cut(cells, c, at, where, seed)) << c.what << " at " << at;
          ++cuts;
          seen.insert(expect_alive(cells, c));
          ASSERT_FALSE(::testing::Test::HasFailure()) << c.what << ", operation " << at << ", seed " << seed;
        }
    EXPECT_TRUE(seen.contains(c.before)) << c.what;
    EXPECT_TRUE(seen.contains(c.after)) << c.what;
    ASSERT_FALSE(update_cut(prepared, c, operations, CutAt::before, 1)) << "there are no more operations";
  }
  std::printf("power cuts of an update, one at a time: %zu\n", cuts);
  EXPECT_GT(cuts, 5000U);
}

TEST(FirmwareUpdate, PairsOfPowerCutsLeaveAWholeImageAndTheNextUpdateWorks) {
  std::size_t pairs = 0;
  for (const Case& c : cases()) {
    SlotCells prepared;
    c.prepare(prepared);
    const std::size_t operations = operations_of(c, prepared);
    // Every seventh operation first, of three kinds in turn; then every fifth of what the next starts do.
    for (std::size_t at = 0; at < operations; at += 7) {
      SlotCells once = prepared;
      ASSERT_TRUE(update_cut(once, c, at, kWheres[at % 3], 100 + at));
      for (std::size_t second = at % 5;; second += 5) {
        SlotCells twice = once;
        std::uint8_t name = 0;
        const CutAt where = kWheres[(at + second) % 3];
        if (run_on(twice, c, second, where, 1000 * at + second, name)) break;
        ++pairs;
        expect_alive(twice, c);
        ASSERT_FALSE(::testing::Test::HasFailure()) << c.what << ", operations " << at << " and " << second;
      }
    }
  }
  std::printf("power cuts of an update, in pairs: %zu\n", pairs);
  EXPECT_GT(pairs, 1000U);
}

// The second download is cut after the first was cut.
TEST(FirmwareUpdate, ADownloadThatIsCutTwiceCostsNothing) {
  std::size_t pairs = 0;
  const Case& c = cases()[1];
  SlotCells prepared;
  c.prepare(prepared);
  const std::size_t operations = operations_of(c, prepared);
  for (std::size_t at = 0; at < operations; at += 11) {
    SlotCells once = prepared;
    ASSERT_TRUE(update_cut(once, c, at, kWheres[at % 3], 7 + at));
    for (std::size_t second = at % 13; second < operations; second += 13) {
      SlotCells twice = once;
      if (!update_cut(twice, c, second, kWheres[(at + second) % 3], 1000 * at + second)) continue;
      ++pairs;
      expect_alive(twice, c);
      ASSERT_FALSE(::testing::Test::HasFailure()) << "operations " << at << " and " << second;
    }
  }
  std::printf("power cuts of two downloads: %zu\n", pairs);
  EXPECT_GT(pairs, 1000U);
}

// The counter of the new image is larger. Wherever the power goes, also with weak bits: no image is started with a
// smaller counter than the drive has shown, the counter is one of an image that was confirmed, and an update that goes
// on ends with the new one.
TEST(FirmwareUpdate, EveryPowerCutLeavesASecurityCounterThatNeverFalls) {
  constexpr std::uint16_t kBefore = 0x0102, kAfter = 0x1234;
  const auto image = [](std::uint8_t name, std::uint16_t counter) {
    return tests::image_named(name, 42, tests::kTestBoard, counter);
  };
  // Starts until nothing is on trial, and once more, which raises the counter.
  const auto finish = [](SlotFlash& flash) {
    for (int i = 0; i < 3; ++i) {
      TestSlots slots(flash, tests::kTestBoard);
      const Start start = slots.resume();
      ASSERT_NE(start, Start::none);
      if (start == Start::trial) {
        ASSERT_TRUE(TestSlots(flash, tests::kTestBoard).confirm());
      }
    }
  };
  const auto run = [&](SlotFlash& flash, std::uint8_t name, std::uint16_t counter) {
    TestSlots slots(flash, tests::kTestBoard);
    ASSERT_TRUE(tests::download(slots, image(name, counter)));
    finish(flash);
  };
  SlotCells prepared;
  {
    SlotFlash flash(prepared);
    run(flash, kOld, kBefore);
  }
  std::size_t operations = 0;
  {
    SlotCells cells = prepared;
    SlotFlash flash(cells);
    run(flash, kNew, kAfter);
    operations = flash.operations();
    EXPECT_EQ(TestSlots(flash, tests::kTestBoard).security_counter(), kAfter);
  }
  std::size_t cuts = 0, raised = 0;
  for (const bool weakens : {false, true})
    for (std::size_t at = 0; at < operations; ++at)
      for (const CutAt where : kWheres)
        for (std::uint64_t seed = 1; seed <= (where == CutAt::inside ? 8U : 1U); ++seed) {
          SlotCells cells = prepared;
          cells.weakens = weakens;
          try {
            SlotFlash flash(cells, seed);
            flash.cut(at, where);
            run(flash, kNew, kAfter);
            FAIL() << "not cut at " << at;
          } catch (const PowerCut&) {
            ++cuts;
          }
          std::uint16_t shown = 0;
          for (std::uint64_t start = 0; start < 4; ++start) {
            SlotFlash flash(cells, 100 * seed + start);
            TestSlots slots(flash, tests::kTestBoard);
            const Start how = slots.resume();
            ASSERT_NE(how, Start::none) << at;
            const std::uint16_t counter = slots.security_counter();
            ASSERT_TRUE(counter == kBefore || counter == kAfter) << at << ": " << counter;
            ASSERT_GE(counter, shown) << at;
            shown = counter;
            boot::ImageHeader header;
            ASSERT_EQ(boot::read_image(slots.image(Slot::application), header), boot::ImageFinding::none);
            ASSERT_GE(header.security_counter, counter) << at;
          }
          raised += shown == kAfter ? 1 : 0;
          SlotFlash flash(cells, seed);
          ASSERT_NO_FATAL_FAILURE(run(flash, kNext, kAfter)) << at;
          ASSERT_EQ(TestSlots(flash, tests::kTestBoard).security_counter(), kAfter);
          TestSlots slots(flash, tests::kTestBoard);
          ASSERT_FALSE(tests::download(slots, image(kOld, kBefore))) << at;
        }
  std::printf("power cuts of an update with a larger counter: %zu, raised before or after %zu\n", cuts, raised);
  EXPECT_GT(cuts, 5000U);
  EXPECT_GT(raised, 0U);
}

// Nothing was ever there: until the new image is whole there is nothing to start, and the boot loader waits.
TEST(FirmwareUpdate, AFirstInstallationThatIsCutEndsInTheNewImageOrWaitsForIt) {
  std::size_t cuts = 0;
  const Case c{"the first installation", [](SlotCells&) {}, Behaviour::does_well, 0, kNew};
  const std::size_t operations = operations_of(c, {});
  for (std::size_t at = 0; at < operations; ++at)
    for (const CutAt where : kWheres) {
      SlotCells cells;
      ASSERT_TRUE(update_cut(cells, c, at, where, at));
      ++cuts;
      SlotFlash flash(cells);
      Start start{};
      std::uint8_t name = 0;
      run_once(flash, Behaviour::does_well, start, name);
      EXPECT_TRUE((start == Start::none && name == 0) || name == kNew) << at;
      if (start == Start::none) install(cells, kNew);
      install(cells, kNext);
      ASSERT_FALSE(::testing::Test::HasFailure()) << at;
    }
  std::printf("power cuts of a first installation: %zu\n", cuts);
}

}  // namespace
}  // namespace flexspline::boot_power_cut_test
