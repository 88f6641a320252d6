// The USB device core with several classes side by side, one of which moves long data over endpoint 0.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/support/usb_parts.hpp"

namespace flexspline::tests::usb_composite_test {
namespace {

constexpr std::uint8_t kSerial = 3;

TEST(UsbComposite, EndsDataThatFillPacketsWithAnEmptyOneOnlyWhereTheHostAskedForMore) {
  TestPort<> wire;
  using Device = usb::Device<usb::FlexsplineIdentity, TestPort<>, BlockClass>;
  // 31 characters make a string descriptor of 64 bytes; the rest of the serial number is not shown.
  Device device{wire, "0123456789012345678901234567890123456789"};
  TestHost<Device, TestPort<>> host{device, wire};
  ASSERT_TRUE(host.enumerate());
  using Sizes = std::vector<std::size_t>;
  EXPECT_EQ(host.descriptor(3, kSerial, 255, 0x0409).packets, (Sizes{64, 0}));
  EXPECT_EQ(host.descriptor(3, kSerial, 64, 0x0409).packets, (Sizes{64}));
  EXPECT_EQ(host.descriptor(3, kSerial, 63, 0x0409).packets, (Sizes{63}));
  EXPECT_EQ(host.text(kSerial), "0123456789012345678901234567890");
  const auto packets = [&](std::uint16_t has, std::uint16_t asked) {
    const Done done = host.get({0xc1, 1, has, 0, asked});
    EXPECT_FALSE(done.stalled || done.hung) << has << " " << asked;
    EXPECT_EQ(done.data, counting(std::min(has, asked)));
    return done.packets;
  };
  EXPECT_EQ(packets(128, 129), (Sizes{64, 64, 0}));
  EXPECT_EQ(packets(128, 128), (Sizes{64, 64}));
  EXPECT_EQ(packets(128, 127), (Sizes{64, 63}));
  EXPECT_EQ(packets(128, 64), (Sizes{64}));
  EXPECT_EQ(packets(129, 200), (Sizes{64, 64, 1}));
  EXPECT_EQ(packets(0, 10), (Sizes{0}));
  EXPECT_TRUE(wire.broken.empty()) << wire.broken.front();
}

TEST(UsbComposite, ASetupInTheMiddleOfATransferBeginsANewOne) {
  CompositeBench b;
  ASSERT_TRUE(b.host.enumerate());
  Octets packet;
  b.host.setup({0xc1, 1, 200, 1, 200});
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);  // one of four packets
  EXPECT_EQ(b.host.descriptor(1, 0, 18).data.size(), 18u);
  b.host.setup({0x41, 1, 0, 1, 150});
  EXPECT_EQ(b.host.out(0, counting(64)), Hand::ack);  // and no more
  EXPECT_EQ(b.host.descriptor(1, 0, 18).data.size(), 18u);
  EXPECT_EQ(b.device.get<BlockClass>().blocks, 0);
  b.host.setup({0x41, 1, 0, 1, 150});  // before its data
  EXPECT_FALSE(b.host.set({0x41, 1, 0, 1, 0}, counting(70)).stalled);
  EXPECT_EQ(b.device.get<BlockClass>().taken, counting(70));
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbComposite, AHostMayEndATransferBeforeItHasAllData) {
  CompositeBench b;
  ASSERT_TRUE(b.host.enumerate());
  Octets packet;
  b.host.setup({0xc1, 1, 200, 1, 200});
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);
  EXPECT_EQ(b.host.out(0, {}), Hand::ack);
  b.host.setup({0x80, 6, 0x0100, 0, 18});
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);
  EXPECT_EQ(b.host.out(0, {1}), Hand::ack);  // data where the status belongs
  EXPECT_EQ(b.host.in(0, packet), Hand::stall);
  EXPECT_EQ(b.host.descriptor(1, 0, 18).data.size(), 18u);
}

TEST(UsbComposite, TakesLongDataWholeOrNotAtAll) {
  CompositeBench b;
  ASSERT_TRUE(b.host.enumerate());
  BlockClass& block = b.device.get<BlockClass>();
  for (const std::size_t n : {1u, 63u, 64u, 65u, 128u, 150u, 200u}) {
    EXPECT_FALSE(b.host.set({0x41, 1, 0, 1, 0}, counting(n, 7)).stalled) << n;
    EXPECT_EQ(block.taken, counting(n, 7));
  }
  EXPECT_EQ(block.ended, 7);
  const int before = block.blocks;
  EXPECT_TRUE(b.host.set({0x41, 1, 0, 1, 0}, counting(201)).stalled);    // longer than anybody takes
  EXPECT_TRUE(b.host.put({0x41, 1, 0, 1, 150}, counting(100)).stalled);  // shorter than promised
  EXPECT_TRUE(b.host.put({0x41, 1, 0, 1, 70}, counting(100)).stalled);   // longer
  EXPECT_TRUE(b.host.put({0x41, 1, 0, 1, 70}, counting(128)).stalled);   // longer by a whole packet
  EXPECT_EQ(block.blocks, before);
  EXPECT_TRUE(b.host.set({0x41, 1, 0, 1, 0}, {0xee}).stalled);  // the class refuses what it got
  EXPECT_EQ(block.blocks, before + 1);
  EXPECT_EQ(block.ended, 7);
  EXPECT_FALSE(b.host.set({0x41, 1, 0, 1, 0}, counting(100)).stalled);
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbComposite, PutsClassesSideBySideInOneConfiguration) {
  CompositeBench b;
  ASSERT_TRUE(b.host.enumerate());
  const auto c = read_configuration(b.host.descriptor(2, 0, 255).data);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->interfaces, 3);
  ASSERT_EQ(c->list.size(), 4u);  // the second interface twice
  EXPECT_EQ(c->list[0].endpoints[0].address, 0x81);
  EXPECT_EQ(c->list[1].number, 1);
  EXPECT_EQ(c->list[2].number, 1);
  EXPECT_EQ(c->list[2].alternate, 1);
  EXPECT_EQ(c->list[3].number, 2);
  EXPECT_EQ(c->list[3].endpoints[0].address, 0x82);
  EXPECT_EQ(c->list[3].endpoints[1].address, 0x02);
  EXPECT_EQ(b.host.text(c->list[1].string), "first area");
  EXPECT_EQ(b.host.text(c->list[2].string), "second area");

  EXPECT_FALSE(b.host.set({0x01, 11, 1, 1, 0}).stalled);
  EXPECT_EQ(b.host.get({0x81, 10, 0, 1, 1}).data, Octets{1});
  EXPECT_TRUE(b.host.set({0x01, 11, 2, 1, 0}).stalled);
  EXPECT_EQ(b.host.get({0x81, 10, 0, 1, 1}).data, Octets{1});

  Octets packet;
  ASSERT_TRUE(b.device.get<SmallHid>().send(report_of(1)));
  ASSERT_TRUE(b.device.get<OtherHid>().send(report_of(2)));
  b.device.poll();
  ASSERT_EQ(b.host.in(2, packet), Hand::ack);
  EXPECT_EQ(packet, Octets(64, 2));
  ASSERT_EQ(b.host.in(1, packet), Hand::ack);
  EXPECT_EQ(packet, Octets(64, 1));
  EXPECT_EQ(b.host.out(2, Octets(64, 9)), Hand::ack);
  usb::Report report;
  EXPECT_FALSE(b.device.get<SmallHid>().receive(report));
  ASSERT_TRUE(b.device.get<OtherHid>().receive(report));
  EXPECT_EQ(report, report_of(9));
  EXPECT_TRUE(b.wire.broken.empty()) << b.wire.broken.front();
}

TEST(UsbDescriptors, TheCheckerFindsEachDefect) {
  using usb::DescriptorFinding;
  constexpr auto kGood = usb::Composition<SmallHid, BlockClass>::kConfiguration;
  ASSERT_EQ(usb::check_configuration(kGood), DescriptorFinding::none);
  const auto with = [&](std::size_t at, std::uint8_t byte) {
    auto bytes = kGood;
    bytes.at(at) = byte;
    return usb::check_configuration(bytes);
  };
  // Offsets: configuration 0, interface 9, HID 18, endpoints 27 and 34, interfaces 41 and 50.
  ASSERT_EQ(kGood.size(), 59u);
  EXPECT_EQ(with(1, 1), DescriptorFinding::header);
  EXPECT_EQ(with(2, 60), DescriptorFinding::total_length);
  EXPECT_EQ(with(4, 3), DescriptorFinding::interface_count);
  EXPECT_EQ(with(9, 8), DescriptorFinding::wrong_length);
  EXPECT_EQ(with(11, 1), DescriptorFinding::interface_order);
  EXPECT_EQ(with(13, 1), DescriptorFinding::endpoint_count);
  EXPECT_EQ(with(13, 3), DescriptorFinding::endpoint_count);
  EXPECT_EQ(with(18, 1), DescriptorFinding::runs_over);
  EXPECT_EQ(with(50, 10), DescriptorFinding::runs_over);
  EXPECT_EQ(with(29, 0x80), DescriptorFinding::endpoint_bad);
  EXPECT_EQ(with(31, 65), DescriptorFinding::endpoint_bad);
  EXPECT_EQ(with(36, 0x81), DescriptorFinding::endpoint_twice);
  EXPECT_EQ(with(53, 0), DescriptorFinding::interface_order);
}

TEST(UsbComposite, AnyRowOfRequestsLeavesItUsable) {
  CompositeBench b;
  std::mt19937 random(7);
  const auto any = [&](std::initializer_list<int> values) {
    return *(values.begin() + static_cast<long>(random() % values.size()));
  };
  int served = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Request r{static_cast<std::uint8_t>(any({0, 1, 2, 0x80, 0x81, 0x82, 0x21, 0xa1, 0x41, 0xc1, 0xc0})),
                    static_cast<std::uint8_t>(random() % 13),
                    static_cast<std::uint16_t>(any({0, 1, 2, 9, 0x100, 0x200, 0x300, 0x301, 0x2100, 0x2200})),
                    static_cast<std::uint16_t>(any({0, 1, 2, 3, 0x81, 0x82, 0x83, 0x409})),
                    static_cast<std::uint16_t>(any({0, 1, 2, 8, 64, 65, 128, 255, 65535}))};
    Octets packet;
    switch (random() % 8) {
      case 0:
        if (random() % 4 == 0) {
          b.host.bus_reset();
        } else {
          b.host.enumerate();
        }
        break;
      case 1:
        b.host.out(static_cast<std::uint8_t>(random() % 3), counting(random() % 65));
        break;
      case 2:
        b.host.in(static_cast<std::uint8_t>(random() % 3), packet);
        break;
      case 3:
        b.device.get<SmallHid>().send(report_of(1));
        b.device.poll();
        break;
      default: {
        const Done done =
            (r.type & 0x80) != 0 ? b.host.get(r) : b.host.put(r, counting(std::min<std::size_t>(r.length, 210)));
        EXPECT_FALSE(done.hung) << i;
        served += done.stalled ? 0 : 1;
      }
    }
    ASSERT_EQ(b.host.descriptor(1, 0, 18).data.size(), 18u) << i;
    ASSERT_TRUE(b.wire.broken.empty()) << i << ": " << b.wire.broken.front();
  }
  EXPECT_GT(served, 150);  // few rows of such fields mean anything
  EXPECT_TRUE(b.host.enumerate());
}

}  // namespace
}  // namespace flexspline::tests::usb_composite_test
