// Suspension and remote wake-up (USB 2.0, 9.1.1.6, 9.2.5.2, 9.4.5, 9.4.9).
#include <gtest/gtest.h>

#include "tests/support/usb_parts.hpp"

namespace flexspline::tests::usb_suspend_test {
namespace {

struct WakingPort : TestPort<false> {
  void wake() { ++wakes; }
  int wakes = 0;
};
struct WakingBench {
  using Device = usb::Device<usb::FlexsplineIdentity, WakingPort, SmallHid>;
  WakingPort wire;
  Device device{wire, "0123456789AB"};
  TestHost<Device, WakingPort> host{device, wire};
};
constexpr Request kAllow{0x00, 3, 1, 0, 0}, kForbid{0x00, 1, 1, 0, 0}, kStatus{0x80, 0, 0, 0, 2};

TEST(UsbSuspend, AddressConfigurationAndWhatWaitsAreThereAfterwards) {
  HidBench b;
  ASSERT_TRUE(b.host.enumerate());
  b.device.suspended();
  EXPECT_TRUE(b.device.is_suspended());
  EXPECT_TRUE(b.device.configured());
  EXPECT_TRUE(b.device.get<SmallHid>().send(report_of(7)));
  b.device.poll();
  Octets packet;
  EXPECT_NE(b.host.in(1, packet), Hand::ack) << "nothing goes while the bus sleeps";
  b.device.resumed();
  b.device.poll();
  ASSERT_EQ(b.host.in(1, packet), Hand::ack);
  EXPECT_EQ(packet, Octets(64, 7));
  EXPECT_EQ(b.wire.address, 5);
  EXPECT_EQ(b.host.get({0x80, 8, 0, 0, 1}).data, Octets{1});
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbSuspend, AResetEndsItAndTakesThePermissionToWakeBack) {
  WakingBench b;
  ASSERT_TRUE(b.host.enumerate());
  ASSERT_FALSE(b.host.put(kAllow, {}).stalled);
  b.device.suspended();
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_FALSE(b.device.is_suspended());
  EXPECT_EQ(b.host.get(kStatus).data, (Octets{1, 0}));
  b.device.suspended();
  EXPECT_FALSE(b.device.wake_host());
  EXPECT_EQ(b.wire.wakes, 0);
}

TEST(UsbSuspend, ADeviceWakesAHostOnlyWhereItSleepsAndHasAllowedIt) {
  WakingBench b;
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_EQ(b.host.descriptor(2, 0, 9).data.at(7), 0xe0) << "self powered, and it can";
  EXPECT_FALSE(b.device.wake_host());
  b.device.suspended();
  EXPECT_FALSE(b.device.wake_host()) << "not allowed";
  b.device.resumed();
  EXPECT_FALSE(b.host.put(kAllow, {}).stalled);
  EXPECT_EQ(b.host.get(kStatus).data, (Octets{3, 0}));
  EXPECT_FALSE(b.device.wake_host()) << "it does not sleep";
  b.device.suspended();
  EXPECT_TRUE(b.device.wake_host());
  EXPECT_EQ(b.wire.wakes, 1);
  b.device.resumed();
  EXPECT_FALSE(b.host.put(kForbid, {}).stalled);
  EXPECT_EQ(b.host.get(kStatus).data, (Octets{1, 0}));
  b.device.suspended();
  EXPECT_FALSE(b.device.wake_host());
  EXPECT_EQ(b.wire.wakes, 1);
}

TEST(UsbSuspend, APortThatCannotWakeIsSaidToBeSoAndTheFeatureIsRefused) {
  HidBench b;
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_EQ(b.host.descriptor(2, 0, 9).data.at(7), 0xc0);
  EXPECT_TRUE(b.host.put(kAllow, {}).stalled);
  EXPECT_TRUE(b.host.put(kForbid, {}).stalled);
  b.device.suspended();
  EXPECT_FALSE(b.device.wake_host());
}

TEST(UsbSuspend, TheFeatureBelongsToADeviceWithAnAddress) {
  WakingBench b;
  b.host.bus_reset();
  EXPECT_TRUE(b.host.put(kAllow, {}).stalled);
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_TRUE(b.host.put({0x00, 3, 1, 1, 0}, {}).stalled) << "wIndex has to be zero";
  EXPECT_TRUE(b.host.put({0x00, 3, 2, 0, 0}, {}).stalled) << "no such feature";
}

}  // namespace
}  // namespace flexspline::tests::usb_suspend_test
