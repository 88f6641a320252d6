// From reset to the loop, with good and dead clocks, and what ends in a reset.
#include <gtest/gtest.h>

#include <string>

#include "shared/protocol/serial_frame.hpp"
#include "tests/board/usb_bus.hpp"

namespace flexspline::tests {
namespace {

const std::string kDac = std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-dac.elf";

const std::string kNucleo = std::string(FLEXSPLINE_BOARDS) + "/nucleo_f446re/nucleo-f446re.elf";

void expect_no_violation(const Chip& chip) {
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}
bool amplifier_is_off(const Chip& chip) {
  return chip.ports[2].mode(6) == 1 && !chip.ports[2].high(6);
}
// The answer to `identify` over a line of bytes.
protocol::Identity identify(Chip& chip, LineModel& line) {
  const auto frame = protocol::serial_frame(protocol::request(protocol::Kind::identify, 1, protocol::Hello{}));
  line.to_chip.insert(line.to_chip.end(), frame.content().begin(), frame.content().end());
  protocol::SerialReader reader;
  protocol::Message m;
  protocol::Identity id;
  chip.ticks(200);
  bool came = false;
  for (const std::uint8_t byte : line.from_chip) came = reader.take(byte, m) || came;
  EXPECT_TRUE(came);
  EXPECT_EQ(protocol::take_payload(m.content(), id), protocol::Code::done);
  return id;
}

TEST(BoardStart, ReachesTheLoopAt168MHzFromTheCrystalWithTheAmplifierOff) {
  Chip chip(kDac);
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.clock.core_hz(), 168e6);
  EXPECT_TRUE(chip.clock.from_crystal());
  EXPECT_EQ(chip.clock.usb_hz(), 48e6);
  EXPECT_TRUE(amplifier_is_off(chip));
  EXPECT_EQ(chip.dac.at(0x08), 2048U);
  EXPECT_EQ(chip.ticks(100), Stop::waits) << chip.machine.where();
  EXPECT_TRUE(amplifier_is_off(chip));
  expect_no_violation(chip);
}

TEST(BoardStart, TheTickComes20000TimesASecondAndTheConverterIsDoneInATenthOfIt) {
  Chip chip(kDac);
  ASSERT_EQ(chip.start(), Stop::waits);
  EXPECT_DOUBLE_EQ(chip.tim1.updates_hz(2 * chip.clock.apb2_hz()), 20'000.0);
  EXPECT_LT(chip.converter.conversion_us(chip.clock.apb2_hz()), 6.0);
}

TEST(BoardStart, ADeadCrystalEndsInTheInternalOscillatorWithoutUsbAndTheSerialLineAnswers) {
  Chip chip(kDac);
  chip.clock.crystal_is_dead = true;
  chip.otg.plug(true);
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.clock.core_hz(), 168e6);
  EXPECT_FALSE(chip.clock.from_crystal());
  EXPECT_FALSE(chip.otg.attached());
  EXPECT_NEAR(chip.usart3.baud(chip.clock.apb1_hz()), 115'200, 0.005 * 115'200);
  EXPECT_STREQ(reinterpret_cast<const char*>(identify(chip, chip.usart3).board.data()), "stm32f405-dac");
  expect_no_violation(chip);
}

TEST(BoardStart, ADeadPllLeavesTheDriveOff) {
  Chip chip(kDac);
  chip.clock.pll_is_dead = true;
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.clock.core_hz(), 16e6);
  EXPECT_FALSE(chip.tim1.triggers());
  EXPECT_TRUE(amplifier_is_off(chip));
  expect_no_violation(chip);
}

TEST(BoardStart, AnUnexpectedExceptionSwitchesTheAmplifierOffAndResetsEvenWithABrokenStack) {
  constexpr std::uint32_t kHardFault = 3;
  Chip chip(kDac);
  ASSERT_EQ(chip.start(), Stop::waits);
  chip.ticks(3);
  chip.ports[2].write(0x18, 1U << 6);  // as if it were on
  chip.machine.set_reg(UC_ARM_REG_SP, 0x1FFFFFF0);
  EXPECT_EQ(chip.machine.interrupt(kHardFault), Stop::reset) << chip.machine.where();
  EXPECT_TRUE(amplifier_is_off(chip));
  EXPECT_EQ(chip.machine.word(kHandover), 0x43525348U) << "the next start knows it";
}

TEST(BoardStart, TheWatchdogRunsBeforeStoreLinesAndTick) {
  Chip chip(kDac);
  int starts = 0;
  // Clocks of TIM1, of the converter and of both serial lines.
  chip.watchdog.started = [&] {
    ++starts;
    EXPECT_EQ(chip.clock.at(0x44) & (1U << 0 | 1U << 8), 0U);
    EXPECT_EQ(chip.clock.at(0x40) & (1U << 17 | 1U << 18), 0U);
  };
  ASSERT_EQ(chip.start(), Stop::waits);
  EXPECT_EQ(starts, 1);
}

TEST(BoardStart, AStackThatOverflowsLeavesTheRamInsteadOfWritingOverVariables) {
  Chip chip(kDac);
  ASSERT_EQ(chip.start(), Stop::waits);
  EXPECT_EQ(chip.machine.symbol("stack_bottom"), 0x20000000U);
  chip.machine.set_reg(UC_ARM_REG_SP, 0x20000010);
  EXPECT_EQ(chip.tick(), Stop::fault);
}

TEST(BoardStart, AnotherBoardRunsTheSameSourcesWithItsOwnClockTimersAndLine) {
  Chip chip(kNucleo,
            {.address = 0x08020000, .sectors = {{5, 0, 0x20000}, {6, 0x20000, 0x20000}, {7, 0x40000, 0x20000, false}}});
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  EXPECT_EQ(chip.clock.core_hz(), 160e6);
  EXPECT_NE(chip.clock.at(0) & (1U << 18), 0U) << "its clock comes from another chip";
  EXPECT_DOUBLE_EQ(chip.tim1.updates_hz(2 * chip.clock.apb2_hz()), 20'000.0);
  EXPECT_NEAR(chip.usart2.baud(chip.clock.apb1_hz()), 115'200, 0.005 * 115'200);
  const protocol::Identity id = identify(chip, chip.usart2);
  EXPECT_STREQ(reinterpret_cast<const char*>(id.board.data()), "nucleo_f446re");
  EXPECT_EQ(id.block_bytes, 0x20000U - 256);
  EXPECT_EQ(id.firmware_key, protocol::FirmwareKey::none) << "no boot loader";
  expect_no_violation(chip);
}

}  // namespace
}  // namespace flexspline::tests
