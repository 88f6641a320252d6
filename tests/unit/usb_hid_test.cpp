// The HID class: reports, their queues, and what halts and resets do to them.
#include <gtest/gtest.h>

#include <cstdint>

#include "tests/support/usb_parts.hpp"

namespace flexspline::tests::usb_hid_test {
namespace {

class UsbHid : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(b.host.enumerate()); }
  void TearDown() override { EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front(); }
  void send(std::uint8_t mark) {
    hid.send(report_of(mark));
    b.device.poll();
  }
  // The mark of the next report to the host, -1 for NAK, -2 for STALL.
  int next() {
    Octets packet;
    const Hand hand = b.host.in(1, packet);
    if (hand != Hand::ack) return hand == Hand::nak ? -1 : -2;
    EXPECT_EQ(packet.size(), 64u);
    return packet.at(0);
  }
  int taken() {
    usb::Report report;
    return hid.receive(report) ? report[0] : -1;
  }

  HidBench b;
  SmallHid& hid = b.device.get<SmallHid>();
};

// Items of HID 1.11, 6.2.2.2: a prefix of size, type and tag, then data.
TEST_F(UsbHid, ReportDescriptorSaysSixtyFourBytesEachWay) {
  const Octets d = b.host.get({0x81, 6, 0x2200, 0, 255}).data;
  const Octets hid_descriptor = b.host.get({0x81, 6, 0x2100, 0, 255}).data;
  ASSERT_EQ(hid_descriptor.size(), 9u);
  EXPECT_EQ(hid_descriptor[7] + 256 * hid_descriptor[8], static_cast<int>(d.size()));
  long page = 0, bits = 0, count = 0, input = 0, output = 0, depth = 0, deepest = 0;
  for (std::size_t at = 0; at < d.size();) {
    const std::size_t n = (d[at] & 3) == 3 ? 4 : d[at] & 3;
    ASSERT_LE(at + n, d.size() - 1);
    long value = 0;
    for (std::size_t k = n; k > 0; --k) value = value * 256 + d[at + k];
    const int item = d[at] & 0xfc;
    if (item == 0x04) page = value;
    if (item == 0x74) bits = value;
    if (item == 0x94) count = value;
    if (item == 0x80) input += bits * count;
    if (item == 0x90) output += bits * count;
    if (item == 0xa0) deepest = std::max(deepest, ++depth);
    if (item == 0xc0) --depth;
    EXPECT_NE(item, 0x84) << "no report numbers";
    at += 1 + n;
  }
  EXPECT_GE(page, 0xff00);  // vendor defined
  EXPECT_EQ(input, 64 * 8);
  EXPECT_EQ(output, 64 * 8);
  EXPECT_EQ(depth, 0);
  EXPECT_EQ(deepest, 1);
}

TEST_F(UsbHid, ReportsToTheHostComeInOrderAndAFullQueueDropsTheNewOne) {
  EXPECT_EQ(next(), -1);
  for (std::uint8_t i = 1; i <= 6; ++i) send(i);
  EXPECT_EQ(hid.room(), 0u);
  EXPECT_EQ(hid.dropped_to_host(), 2u);
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(next(), i);
  EXPECT_EQ(next(), -1);
  EXPECT_EQ(hid.room(), 4u);
  send(7);
  EXPECT_EQ(next(), 7);
}

TEST_F(UsbHid, ReportsFromTheHostWaitInsteadOfBeingLost) {
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(b.host.out(1, Octets(64, static_cast<std::uint8_t>(i))), Hand::ack);
  EXPECT_EQ(b.host.out(1, Octets(64, 4)), Hand::nak);
  EXPECT_EQ(taken(), 1);
  b.device.poll();
  EXPECT_EQ(b.host.out(1, Octets(64, 4)), Hand::ack);
  EXPECT_EQ(b.host.out(1, Octets(64, 5)), Hand::nak);
  for (int i = 2; i <= 4; ++i) EXPECT_EQ(taken(), i);
  EXPECT_EQ(taken(), -1);
}

TEST_F(UsbHid, AShortReportIsFilledWithZerosAndAnEmptyOneIsNone) {
  EXPECT_EQ(b.host.out(1, Octets(64, 0xff)), Hand::ack);
  EXPECT_EQ(taken(), 0xff);
  b.device.poll();
  for (int i = 0; i < 3; ++i) {  // into the places where 0xff stood
    EXPECT_EQ(b.host.out(1, {1, 2, 3}), Hand::ack);
    usb::Report report;
    ASSERT_TRUE(hid.receive(report));
    usb::Report expected{1, 2, 3};
    EXPECT_EQ(report, expected);
    b.device.poll();
  }
  EXPECT_EQ(b.host.out(1, {}), Hand::ack);
  EXPECT_EQ(taken(), -1);
  EXPECT_EQ(b.host.out(1, Octets(64, 6)), Hand::ack);
  EXPECT_EQ(taken(), 6);
}

TEST_F(UsbHid, SetReportComesInLikeAPacketAndIsRefusedAndCountedWithoutRoom) {
  const auto set_report = [&](std::uint16_t value, const Octets& data) {
    return !b.host.set({0x21, 9, value, 0, 0}, data).stalled;
  };
  EXPECT_TRUE(set_report(0x0200, Octets(64, 1)));
  EXPECT_TRUE(set_report(0x0200, Octets(5, 2)));
  // The third place is kept for the packet that the endpoint is ready for.
  EXPECT_FALSE(set_report(0x0200, Octets(64, 3)));
  EXPECT_EQ(hid.dropped_from_host(), 1u);
  EXPECT_EQ(b.host.out(1, Octets(64, 4)), Hand::ack);
  for (const int mark : {1, 2, 4}) EXPECT_EQ(taken(), mark);
  EXPECT_FALSE(set_report(0x0200, {}));
  EXPECT_FALSE(set_report(0x0200, Octets(65, 1)));
  EXPECT_FALSE(set_report(0x0300, Octets(64, 1)));  // a feature
  EXPECT_FALSE(set_report(0x0201, Octets(64, 1)));  // a report number
  EXPECT_EQ(taken(), -1);
}

TEST_F(UsbHid, GetReportShowsWhatGoesNextAndLeavesIt) {
  EXPECT_EQ(b.host.get({0xa1, 1, 0x0100, 0, 64}).data, Octets(64, 0));
  send(8);
  EXPECT_EQ(b.host.get({0xa1, 1, 0x0100, 0, 64}).data, Octets(64, 8));
  EXPECT_EQ(b.host.get({0xa1, 1, 0x0100, 0, 10}).data, Octets(10, 8));
  EXPECT_EQ(next(), 8);
  EXPECT_TRUE(b.host.get({0xa1, 1, 0x0200, 0, 64}).stalled);
  EXPECT_TRUE(b.host.get({0xa1, 1, 0x0101, 0, 64}).stalled);
}

TEST_F(UsbHid, KnowsTheIdleRateAndTheProtocolThatItHas) {
  EXPECT_FALSE(b.host.set({0x21, 10, 0, 0, 0}).stalled);
  EXPECT_TRUE(b.host.set({0x21, 10, 0x0500, 0, 0}).stalled);
  EXPECT_EQ(b.host.get({0xa1, 2, 0, 0, 1}).data, Octets{0});
  EXPECT_FALSE(b.host.set({0x21, 11, 1, 0, 0}).stalled);
  EXPECT_TRUE(b.host.set({0x21, 11, 0, 0, 0}).stalled);
  EXPECT_TRUE(b.host.get({0xa1, 3, 0, 0, 1}).stalled);
}

TEST_F(UsbHid, AHaltLosesNoReportAndBeginsAtDataZero) {
  send(1);
  send(2);
  const int began = b.wire.pipes[0x81].began;
  ASSERT_FALSE(b.host.set({0x02, 3, 0, 0x81, 0}).stalled);
  EXPECT_EQ(b.host.get({0x82, 0, 0, 0x81, 2}).data, (Octets{1, 0}));
  EXPECT_EQ(b.host.get({0x82, 0, 0, 0x01, 2}).data, (Octets{0, 0}));
  EXPECT_EQ(next(), -2);
  send(3);
  EXPECT_EQ(next(), -2);
  ASSERT_FALSE(b.host.set({0x02, 1, 0, 0x81, 0}).stalled);
  EXPECT_EQ(b.host.get({0x82, 0, 0, 0x81, 2}).data, (Octets{0, 0}));
  EXPECT_EQ(b.wire.pipes[0x81].began, began + 1);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(next(), i);

  // Not halted: the toggle begins anew all the same (9.4.5), and what waits goes once.
  send(4);
  ASSERT_FALSE(b.host.set({0x02, 1, 0, 0x81, 0}).stalled);
  EXPECT_EQ(b.wire.pipes[0x81].began, began + 2);
  EXPECT_EQ(next(), 4);
  EXPECT_EQ(next(), -1);

  ASSERT_FALSE(b.host.set({0x02, 3, 0, 0x01, 0}).stalled);
  EXPECT_EQ(b.host.out(1, Octets(64, 5)), Hand::stall);
  b.device.poll();
  ASSERT_FALSE(b.host.set({0x02, 1, 0, 0x01, 0}).stalled);
  EXPECT_EQ(b.host.out(1, Octets(64, 5)), Hand::ack);
  EXPECT_EQ(taken(), 5);
}

TEST_F(UsbHid, AResetOrAnotherConfigurationEmptiesTheQueues) {
  const auto fill = [&] {
    send(1);
    EXPECT_EQ(b.host.out(1, Octets(64, 2)), Hand::ack);
  };
  fill();
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_EQ(next(), -1);
  EXPECT_EQ(taken(), -1);
  fill();
  ASSERT_FALSE(b.host.set_configuration(1).stalled);
  EXPECT_EQ(next(), -1);
  EXPECT_EQ(taken(), -1);
  fill();
  ASSERT_FALSE(b.host.set({0x01, 11, 0, 0, 0}).stalled);
  EXPECT_EQ(next(), -1);
  fill();
  EXPECT_EQ(next(), 1);
  b.host.bus_reset();
  EXPECT_FALSE(hid.send(report_of(1)));  // nobody there, which is no drop
  EXPECT_EQ(hid.room(), 0u);
  EXPECT_EQ(hid.dropped_to_host(), 0u);
}

}  // namespace
}  // namespace flexspline::tests::usb_hid_test
