// The brown-out reset of the chip: set once in the option bytes, by the boot loader, or by the application where there
// is none.
#include <gtest/gtest.h>

#include <string>

#include "tests/board/chip.hpp"

namespace flexspline::tests {
namespace {

constexpr std::uint32_t kLevel = 3U << 2;
const std::string kLoader = std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-dac-boot.elf";
const WrittenFlash kSlots{
    .address = 0x0800C000,
    .sectors = {
        {3, 0, 0x4000}, {4, 0x4000, 0x10000}, {5, 0x14000, 0x20000}, {6, 0x34000, 0x20000}, {7, 0x54000, 0x20000}}};

void expect_no_violation(const Chip& chip) {
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}

TEST(BoardBrownOut, TheBootLoaderSetsItOnceAndNothingElse) {
  Chip chip(kLoader, kSlots);
  const std::uint32_t before = chip.flash.options;
  ASSERT_EQ(before & kLevel, kLevel) << "off, as delivered";
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.flash.options & kLevel, 0U) << "level 3";
  EXPECT_EQ(chip.flash.options | kLevel, before) << "protections as they were, and locked again";
  EXPECT_EQ(chip.flash.option_writes, 1);
  expect_no_violation(chip);

  Chip next(kLoader, kSlots);
  next.flash.options = chip.flash.options;
  ASSERT_EQ(next.start(), Stop::waits);
  EXPECT_EQ(next.flash.option_writes, 0);
}

TEST(BoardBrownOut, AChipWhoseOptionBytesAreFinalStartsAllTheSame) {
  Chip chip(kLoader, kSlots);
  chip.flash.options_are_final = true;
  EXPECT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.flash.option_writes, 0);
  expect_no_violation(chip);
}

TEST(BoardBrownOut, AnApplicationWithoutABootLoaderSetsItItself) {
  Chip chip(std::string(FLEXSPLINE_BOARDS) + "/nucleo_f446re/nucleo-f446re.elf",
            {.address = 0x08020000, .sectors = {{5, 0, 0x20000}, {6, 0x20000, 0x20000}, {7, 0x40000, 0x20000, false}}});
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.flash.options & kLevel, 0U);
  EXPECT_EQ(chip.flash.option_writes, 1);
  expect_no_violation(chip);
}

TEST(BoardBrownOut, AnApplicationWithABootLoaderLeavesTheOptionBytesAlone) {
  Chip chip(std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-dac.elf");
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.flash.option_writes, 0);
}

}  // namespace
}  // namespace flexspline::tests
