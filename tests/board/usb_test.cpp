// The USB controller's driver under the device core, against a modelled controller and host.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/board/usb_bus.hpp"

namespace flexspline::tests {
namespace {

class BoardUsb : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where(); }
  void TearDown() override {
    for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
  }
  Chip chip{std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-dac.elf"};
  UsbBus bus{chip};
};

TEST_F(BoardUsb, ShowsItselfOnlyWhileTheBusIsPowered) {
  EXPECT_FALSE(chip.otg.attached());
  chip.otg.plug(true);
  EXPECT_TRUE(chip.otg.attached());
  chip.otg.plug(false);
  EXPECT_FALSE(chip.otg.attached());
}

TEST_F(BoardUsb, AnswersAtAddressZeroAfterABusResetAndThenAtItsOwn) {
  chip.otg.plug(true);
  bus.reset();
  const auto head = bus.descriptor(1, 0, 64);
  ASSERT_EQ(head.size(), 18U);
  EXPECT_EQ(head[7], 64);  // packets of endpoint 0
  ASSERT_TRUE(bus.control_out({0x00, 5, 17, 0, 0, 0, 0, 0}));
  EXPECT_EQ(chip.otg.address(), 17);
  EXPECT_TRUE(bus.descriptor(1, 0, 18).empty()) << "address zero is nobody's any more";
  bus.move_to(17);
  EXPECT_EQ(bus.descriptor(1, 0, 18), head);
  bus.reset();
  EXPECT_EQ(bus.descriptor(1, 0, 18), head) << "a reset brings it back to zero";
}

TEST_F(BoardUsb, SendsDescriptorsInWholePacketsAndItsChipsNumberAsText) {
  ASSERT_TRUE(bus.enumerate());
  const auto configuration = bus.descriptor(2, 0, 255);
  ASSERT_GE(configuration.size(), 41U);
  EXPECT_EQ(configuration[2] + 256U * configuration[3], configuration.size());
  // Words 0x11112222, 0xABCD0000, 0x03040506 of the chip: the sum of the first and the last, and half of the second.
  std::string serial;
  const auto text = bus.descriptor(3, 3, 255);
  EXPECT_TRUE(text.empty()) << "a string has its language in wIndex";
  const auto in_english = bus.control_in({0x80, 6, 3, 3, 0x09, 0x04, 255, 0});
  ASSERT_TRUE(in_english);
  for (std::size_t i = 2; i < in_english->size(); i += 2) serial += static_cast<char>((*in_english)[i]);
  EXPECT_EQ(serial, "14152728ABCD");
}

TEST_F(BoardUsb, StallsWhatItDoesNotKnowAndServesTheNextRequest) {
  ASSERT_TRUE(bus.enumerate());
  EXPECT_FALSE(bus.control_in({0x80, 6, 0, 6, 0, 0, 10, 0}));  // a qualifier is for high speed
  EXPECT_FALSE(bus.control_out({0x40, 99, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bus.descriptor(1, 0, 18).size(), 18U);
}

TEST_F(BoardUsb, ANewSetupVoidsWhatWaitedOnEndpointZero) {
  ASSERT_TRUE(bus.enumerate());
  // The host asks for a descriptor and never fetches it.
  const std::vector<std::uint8_t> setup{0x80, 6, 0, 2, 0, 0, 255, 0};
  ASSERT_EQ(chip.otg.setup(9, setup), Handshake::ack);
  chip.ticks(3);
  EXPECT_EQ(bus.descriptor(1, 0, 18).size(), 18U);
}

TEST_F(BoardUsb, IdentifiesItselfOverReports) {
  ASSERT_TRUE(bus.enumerate());
  const protocol::Message m = bus.ask(protocol::Kind::identify, protocol::Hello{});
  EXPECT_EQ(m.code, 0);
  protocol::Identity id;
  ASSERT_EQ(protocol::take_payload(m.content(), id), protocol::Code::done);
  EXPECT_STREQ(reinterpret_cast<const char*>(id.board.data()), "stm32f405-dac");
  EXPECT_STREQ(reinterpret_cast<const char*>(id.serial.data()), "14152728ABCD");
  EXPECT_EQ(id.firmware_key, protocol::FirmwareKey::development);
  EXPECT_EQ(id.tick_hz, 20'000U);
  EXPECT_GT(id.effects, 40);
}

TEST_F(BoardUsb, TogglesGoOnOverManyReportsAndBeginAnewAfterAHalt) {
  ASSERT_TRUE(bus.enumerate());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(bus.ask(protocol::Kind::identify, protocol::Hello{}).code, 0) << i;
  EXPECT_TRUE(bus.control_out({0x02, 3, 0, 0, 0x81, 0, 0, 0}));  // SET_FEATURE(HALT), endpoint 1 IN
  EXPECT_TRUE(bus.control_out({0x02, 3, 0, 0, 0x01, 0, 0, 0}));
  std::vector<std::uint8_t> report;
  EXPECT_EQ(bus.read(report), Handshake::stall);
  EXPECT_EQ(bus.write(protocol::Report{}), Handshake::stall);
  EXPECT_TRUE(bus.control_out({0x02, 1, 0, 0, 0x81, 0, 0, 0}));
  EXPECT_TRUE(bus.control_out({0x02, 1, 0, 0, 0x01, 0, 0, 0}));
  bus.toggles_begin_anew();
  EXPECT_EQ(bus.ask(protocol::Kind::identify, protocol::Hello{}).code, 0);
}

TEST_F(BoardUsb, SaysNakUntilItHasRoomAndLosesNoReport) {
  ASSERT_TRUE(bus.enumerate());
  // Requests as fast as the bus goes, with no time for the drive and nobody who reads.
  const protocol::Message request = protocol::request(protocol::Kind::identify, 1, protocol::Hello{});
  int naks = 0, taken = 0;
  bool data1 = false;
  for (int i = 0; i < 60; ++i) {
    const Handshake hand = chip.otg.out(9, 1, protocol::encode(request), data1);
    if (hand == Handshake::ack) {
      ++taken;
      data1 = !data1;
    } else {
      ASSERT_EQ(hand, Handshake::nak);
      ++naks;
      chip.tick();
    }
  }
  EXPECT_GT(naks, 10);
  EXPECT_GT(taken, 8);
  std::vector<std::uint8_t> report;
  int answers = 0;
  while (bus.read(report) == Handshake::ack) ++answers;
  EXPECT_EQ(answers, taken);
}

TEST_F(BoardUsb, APacketThatIsSentAgainIsTakenOnce) {
  ASSERT_TRUE(bus.enumerate());
  const protocol::Report report = protocol::encode(protocol::request(protocol::Kind::identify, 1, protocol::Hello{}));
  chip.tick();
  ASSERT_EQ(chip.otg.out(9, 1, report, false), Handshake::ack);
  chip.ticks(3);
  ASSERT_EQ(chip.otg.out(9, 1, report, false), Handshake::ack) << "its handshake was lost";
  chip.ticks(3);
  std::vector<std::uint8_t> answer;
  EXPECT_EQ(bus.read(answer), Handshake::ack);
  EXPECT_EQ(bus.read(answer), Handshake::nak);
}

TEST_F(BoardUsb, GoesOnAfterASuspendedBus) {
  ASSERT_TRUE(bus.enumerate());
  chip.otg.suspend();
  chip.ticks(200);
  chip.otg.resume();
  EXPECT_EQ(bus.ask(protocol::Kind::identify, protocol::Hello{}).code, 0);
}

TEST_F(BoardUsb, IsThereAgainAfterItWasUnplugged) {
  ASSERT_TRUE(bus.enumerate(9));
  EXPECT_EQ(bus.ask(protocol::Kind::identify, protocol::Hello{}).code, 0);
  chip.otg.plug(false);
  chip.ticks(20);
  ASSERT_TRUE(bus.enumerate(11));
  EXPECT_EQ(bus.ask(protocol::Kind::status).code, static_cast<int>(protocol::Code::wrong_version))
      << "another host has to identify itself";
  EXPECT_EQ(bus.ask(protocol::Kind::identify, protocol::Hello{}).code, 0);
}

}  // namespace
}  // namespace flexspline::tests
