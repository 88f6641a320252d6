// The USB device core against a host written from the specification.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/usb_parts.hpp"

namespace flexspline::tests::usb_device_test {
namespace {

constexpr std::uint8_t kSerial = 3;

TEST(UsbDevice, EnumeratesAsHostsDoIt) {
  HidBench b;
  b.host.bus_reset();
  const Done first = b.host.descriptor(1, 0, 8);
  EXPECT_EQ(first.data.size(), 8u);
  EXPECT_EQ(first.data[7], 64);
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_EQ(b.wire.address, 5);
  EXPECT_TRUE(b.device.configured());
  const Done device = b.host.descriptor(1, 0, 18);
  const Octets expected{18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x09, 0x12, 0x01, 0x00, 0x10, 0x00, 1, 2, 3, 1};
  EXPECT_EQ(device.data, expected);
  EXPECT_EQ(b.host.get({0x80, 8, 0, 0, 1}).data, Octets{1});
  EXPECT_EQ(b.host.get({0x80, 0, 0, 0, 2}).data, (Octets{1, 0}));  // self powered
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbDevice, DescribesOneHidInterfaceWithTwoInterruptEndpoints) {
  HidBench b;
  ASSERT_TRUE(b.host.enumerate());
  const Done head = b.host.descriptor(2, 0, 9);
  const auto short_one = read_configuration(head.data);
  ASSERT_TRUE(short_one);
  const Done whole = b.host.descriptor(2, 0, short_one->total);
  const auto c = read_configuration(whole.data);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->total, whole.data.size());
  EXPECT_EQ(c->interfaces, 1);
  EXPECT_EQ(c->value, 1);
  EXPECT_EQ(c->attributes, 0xc0);  // bit 7 is always set
  EXPECT_LE(c->power * 2, 100);
  ASSERT_EQ(c->list.size(), 1u);
  const ReadInterface& i = c->list[0];
  EXPECT_EQ(i.code, 3);
  EXPECT_EQ(i.subclass + i.protocol, 0);  // no boot device
  ASSERT_EQ(i.others.size(), 1u);
  EXPECT_EQ(i.others[0][1], 0x21);
  ASSERT_EQ(i.endpoints.size(), i.promised);
  EXPECT_EQ(i.endpoints[0].address, 0x81);
  EXPECT_EQ(i.endpoints[1].address, 0x01);
  for (const ReadEndpoint& e : i.endpoints) {
    EXPECT_EQ(e.attributes, 3);
    EXPECT_EQ(e.packet, 64);
    EXPECT_EQ(e.interval, 1);
  }
}

TEST(UsbDevice, SaysItsStringsInTheLanguageItLists) {
  HidBench b;
  ASSERT_TRUE(b.host.enumerate());
  EXPECT_EQ(b.host.descriptor(3, 0, 255).data, (Octets{4, 3, 0x09, 0x04}));
  EXPECT_EQ(b.host.text(1), "Flexspline");
  EXPECT_EQ(b.host.text(2), "Flexspline drive");
  EXPECT_EQ(b.host.text(kSerial), "0123456789AB");
  EXPECT_TRUE(b.host.descriptor(3, 4, 255, 0x0409).stalled);
  EXPECT_TRUE(b.host.descriptor(3, 1, 255, 0x0407).stalled);
  EXPECT_TRUE(b.host.descriptor(3, 0xee, 255, 0x0409).stalled);
}

TEST(UsbDevice, RefusesWhatItDoesNotKnowAndServesTheNextRequest) {
  const std::vector<Request> unknown{
      {0x80, 6, 0x0200 | 1, 0, 9},  // a second configuration
      {0x80, 6, 0x0600, 0, 10},     // device qualifier: full speed only
      {0x80, 6, 0x0700, 0, 9},      // other speed
      {0x80, 6, 0x0f00, 0, 5},      // BOS
      {0x80, 6, 0x2200, 0, 64},     // a class descriptor of the device
      {0x81, 6, 0x2200, 3, 64},     // of an interface that is not there
      {0x81, 6, 0x2201, 0, 64},     // a second report descriptor
      {0x00, 7, 0x0100, 0, 0},      // SET_DESCRIPTOR
      {0x00, 9, 2, 0, 0},           // a configuration that is not there
      {0x00, 3, 1, 0, 0},           // remote wake-up
      {0x00, 3, 2, 0x0100, 0},      // test mode
      {0x00, 5, 9, 0, 0},           // an address while configured
      {0x02, 3, 0, 0x0082, 0},      // halt of an endpoint that is not there
      {0x02, 3, 0, 0x0181, 0},      // nor this one
      {0x02, 3, 1, 0x0081, 0},      // no feature of endpoints
      {0x02, 3, 0, 0, 0},           // halt of endpoint 0
      {0x01, 11, 1, 0, 0},          // an alternate setting that is not there
      {0x82, 0, 0, 0x0082, 2},      // status of no endpoint
      {0x82, 12, 0, 0x0081, 2},     // SYNCH_FRAME
      {0x83, 0, 0, 0, 2},           // to "other"
      {0x80, 0x33, 0, 0, 2},        // no request of chapter 9
      {0xc0, 1, 0, 0, 16},          // vendor
      {0x40, 1, 0, 0, 0},           // vendor
      {0xe0, 1, 0, 0, 16},          // reserved kind
      {0xa2, 1, 0, 0x0081, 16},     // class, to an endpoint
      {0x9f, 0, 0, 0, 2},           // reserved recipient
      {0x80, 8, 1, 0, 1},           // GET_CONFIGURATION with a value
      {0x01, 9, 1, 0, 0},           // SET_CONFIGURATION to an interface
  };
  HidBench b;
  ASSERT_TRUE(b.host.enumerate());
  for (const Request& r : unknown) {
    const Done done = (r.type & 0x80) != 0 ? b.host.get(r) : b.host.set(r);
    EXPECT_TRUE(done.stalled) << int{r.type} << " " << int{r.request} << " " << r.value << " " << r.index;
    EXPECT_EQ(b.host.descriptor(1, 0, 18).data.size(), 18u);
  }
  EXPECT_TRUE(b.device.configured());
  EXPECT_EQ(b.device.address(), 5);
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbDevice, KnowsBeforeItIsConfiguredOnlyWhatTheSpecificationAllows) {
  HidBench b;
  b.host.bus_reset();
  EXPECT_TRUE(b.host.set_configuration(1).stalled);  // default state
  ASSERT_FALSE(b.host.set_address(7).stalled);
  EXPECT_EQ(b.host.get({0x80, 8, 0, 0, 1}).data, Octets{0});
  EXPECT_EQ(b.host.get({0x82, 0, 0, 0, 2}).data, (Octets{0, 0}));  // endpoint 0
  EXPECT_TRUE(b.host.get({0x82, 0, 0, 0x81, 2}).stalled);
  EXPECT_TRUE(b.host.get({0x81, 0, 0, 0, 2}).stalled);
  EXPECT_TRUE(b.host.get({0x81, 10, 0, 0, 1}).stalled);
  EXPECT_TRUE(b.host.get({0x81, 6, 0x2200, 0, 64}).stalled);
  EXPECT_FALSE(b.wire.pipes[0x81].open);
  ASSERT_FALSE(b.host.set_configuration(1).stalled);
  EXPECT_TRUE(b.wire.pipes[0x81].open);
  EXPECT_EQ(b.host.get({0x81, 10, 0, 0, 1}).data, Octets{0});
  ASSERT_FALSE(b.host.set_configuration(0).stalled);
  EXPECT_FALSE(b.wire.pipes[0x81].open);
  EXPECT_EQ(b.host.get({0x80, 8, 0, 0, 1}).data, Octets{0});
}

TEST(UsbDevice, TakesItsAddressWhenTheHostHasSeenTheStatusStage) {
  HidBench b;
  b.host.bus_reset();
  Octets packet;
  b.host.setup({0x00, 5, 9, 0, 0});
  EXPECT_EQ(b.wire.address, 0);
  b.host.setup({0x80, 6, 0x0100, 0, 18});  // the host gave up on it
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);
  EXPECT_EQ(b.wire.address, 0);
  EXPECT_EQ(b.device.address(), 0);
  b.host.setup({0x00, 5, 9, 0, 0});
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);
  EXPECT_EQ(b.wire.address, 9);
  EXPECT_TRUE(b.host.set_address(200).stalled);
  b.host.bus_reset();
  EXPECT_EQ(b.device.address(), 0);

  // Controllers that wait by themselves are informed before.
  Bench<true, SmallHid> early;
  early.host.bus_reset();
  early.host.setup({0x00, 5, 9, 0, 0});
  EXPECT_EQ(early.wire.address, 9);
  EXPECT_EQ(early.host.in(0, packet), Hand::ack);
  EXPECT_EQ(early.device.address(), 9);
}

}  // namespace
}  // namespace flexspline::tests::usb_device_test
