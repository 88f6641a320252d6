// The USB/IP server over a socket, with a client that is written apart from it, and the drive's device core behind it.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hil/usbip/core_device.hpp"
#include "hil/usbip/server.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"
#include "tests/support/usbip_client.hpp"

namespace flexspline::tests::usbip_server_test {
namespace {

using Reports = usb::Hid<8, 4>;
using HidDevice = usbip::CoreDevice<usb::FlexsplineIdentity, Reports>;

constexpr int kStall = -32, kShort = -121, kUnlinked = -104;

class UsbIpServer : public ::testing::Test {
 protected:
  UsbIpServer() {
    server.plug("1-1", first);
    server.plug("1-2", second);
  }
  // Sends back what comes, while `echoes`.
  void turn() {
    server.serve(1);
    for (HidDevice* device : {&first, &second}) {
      usb::Report report;
      while (echoes && device->get<Reports>().room() > 0 && device->get<Reports>().receive(report))
        device->get<Reports>().send(report);
      device->poll();
    }
  }
  std::unique_ptr<UsbIpClient> client() {
    return std::make_unique<UsbIpClient>(server.port(), [this] { turn(); });
  }
  std::unique_ptr<UsbIpClient> attached(const std::string& bus_id = "1-1") {
    auto c = client();
    EXPECT_EQ(c->import(bus_id), 0);
    EXPECT_EQ(c->set(0x00, 9, 1, 0).status, 0);
    return c;
  }
  Octets report(std::uint8_t mark) { return Octets(64, mark); }

  bool echoes = true;
  HidDevice first{"FIRST"}, second{"SECOND"};
  usbip::Server server{0};
};

TEST_F(UsbIpServer, ListsItsDevicesWithTheirInterfaces) {
  auto c = client();
  c->send(devlist_request());
  const auto reply = c->receive(12 + 2 * 316);
  ASSERT_TRUE(reply);
  EXPECT_EQ(get32(*reply, 0), 0x01110005u);
  EXPECT_EQ(get32(*reply, 4), 0u);
  EXPECT_EQ(get32(*reply, 8), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t at = 12 + 316 * i;
    EXPECT_EQ(get_text(*reply, at + 256), i == 0 ? "1-1" : "1-2");
    EXPECT_NE(get_text(*reply, at).find(get_text(*reply, at + 256)), std::string::npos);
    EXPECT_EQ(get32(*reply, at + 288), 1u);
    EXPECT_EQ(get32(*reply, at + 292), i + 1);
    EXPECT_EQ(get32(*reply, at + 296), 2u);  // full speed
    EXPECT_EQ(get16(*reply, at + 300), 0x1209u);
    EXPECT_EQ(get16(*reply, at + 302), 0x0001u);
    EXPECT_EQ(get16(*reply, at + 304), 0x0010u);
    EXPECT_EQ(reply->at(at + 309), 1);  // configuration
    EXPECT_EQ(reply->at(at + 310), 1);
    EXPECT_EQ(reply->at(at + 311), 1);  // interfaces
    EXPECT_EQ(reply->at(at + 312), 3);  // HID
  }
  EXPECT_TRUE(c->is_closed());
  EXPECT_EQ(server.faults(), 0u);
}

TEST_F(UsbIpServer, LendsADeviceToOneClientAtATime) {
  auto c = client();
  EXPECT_EQ(c->import("1-1"), 0);
  EXPECT_TRUE(server.imported("1-1"));
  EXPECT_EQ(client()->import("1-1"), 2);
  EXPECT_EQ(client()->import("1-3"), 4);
  EXPECT_EQ(client()->import(""), 4);
  auto other = client();
  EXPECT_EQ(other->import("1-2"), 0);
  c->hang_up();
  for (int i = 0; i < 20; ++i) turn();
  EXPECT_FALSE(server.imported("1-1"));
  EXPECT_EQ(client()->import("1-1"), 0);
  EXPECT_TRUE(server.imported("1-2"));
}

TEST_F(UsbIpServer, CarriesControlTransfers) {
  auto c = client();
  ASSERT_EQ(c->import("1-1"), 0);
  const Returned device = c->get(0x80, 6, 0x0100, 0, 64);
  EXPECT_EQ(device.status, 0);
  EXPECT_EQ(device.actual, 18u);
  EXPECT_EQ(device.data.at(7), 64);
  EXPECT_EQ(c->get(0x80, 6, 0x0200, 0, 9).data.size(), 9u);
  EXPECT_EQ(c->get(0x80, 6, 0x0600, 0, 10).status, kStall);
  EXPECT_EQ(c->get(0x80, 8, 0, 0, 1).data, Octets{0});
  EXPECT_EQ(c->set(0x00, 9, 1, 0).status, 0);
  EXPECT_EQ(c->get(0x80, 8, 0, 0, 1).data, Octets{1});
  EXPECT_EQ(c->get(0x80, 6, 0x0303, 0x0409, 255).data, (Octets{12, 3, 'F', 0, 'I', 0, 'R', 0, 'S', 0, 'T', 0}));
  EXPECT_EQ(c->set(0x21, 9, 0x0200, 0, report(5)).status, 0);
  EXPECT_EQ(c->set(0x00, 9, 7, 0).status, kStall);
  // Lengths that are not those of the request, and data the wrong way.
  c->submit({.in = true, .setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 18), .length = 64});
  EXPECT_EQ(c->returned()->status, -22);
  c->submit({.setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 18), .data = Octets(18)});
  EXPECT_EQ(c->returned()->status, -22);
  c->submit({.in = true, .setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 64), .length = 64, .flags = 1});
  EXPECT_EQ(c->returned()->status, kShort);
}

TEST_F(UsbIpServer, EchoesHundredsOfReportsInOrder) {
  auto c = attached();
  for (int i = 0; i < 300; ++i) {
    const auto mark = static_cast<std::uint8_t>(i);
    const std::uint32_t in = c->submit({.endpoint = 1, .in = true, .length = 64});
    const std::uint32_t out = c->submit({.endpoint = 1, .data = report(mark)});
    const auto written = c->returned();
    const auto read = c->returned();
    ASSERT_TRUE(written && read) << i;
    EXPECT_EQ(written->sequence, out);
    EXPECT_EQ(written->actual, 64u);
    EXPECT_EQ(read->sequence, in);
    EXPECT_EQ(read->data, report(mark));
  }
}

TEST_F(UsbIpServer, TransfersWaitForTheDeviceAndKeepTheirOrder) {
  echoes = false;
  auto c = attached();
  std::vector<std::uint32_t> sequences;
  for (std::uint8_t i = 0; i < 6; ++i) sequences.push_back(c->submit({.endpoint = 1, .data = report(i)}));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(c->returned()->sequence, sequences[i]);
  EXPECT_EQ(c->unread(), 0u);  // the device's queue is full
  usb::Report got;
  ASSERT_TRUE(first.get<Reports>().receive(got));
  EXPECT_EQ(c->returned()->sequence, sequences[4]);
  EXPECT_EQ(c->unread(), 0u);
  for (std::uint8_t i = 1; i < 6; ++i) {
    ASSERT_TRUE(first.get<Reports>().receive(got)) << int{i};
    EXPECT_EQ(got[0], i);
    turn();
  }
  EXPECT_EQ(c->returned()->sequence, sequences[5]);
}

TEST_F(UsbIpServer, LongTransfersGoInPackets) {
  echoes = false;
  auto c = attached();
  Octets data(150);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
  c->submit({.endpoint = 1, .data = data});
  const auto done = c->returned();
  EXPECT_EQ(done->status, 0);
  EXPECT_EQ(done->actual, 150u);
  usb::Report got;
  for (const int mark : {0, 64, 128}) {
    ASSERT_TRUE(first.get<Reports>().receive(got));
    EXPECT_EQ(got[0], mark);
  }
  EXPECT_EQ(got[21], 149);
  EXPECT_EQ(got[22], 0);
  // More than the device has room for: it goes on where it stopped.
  Octets six(6 * 64);
  for (std::size_t i = 0; i < six.size(); ++i) six[i] = static_cast<std::uint8_t>(i / 64);
  const std::uint32_t out = c->submit({.endpoint = 1, .data = six});
  EXPECT_EQ(c->unread(), 0u);
  for (int mark = 0; mark < 6; ++mark) {
    ASSERT_TRUE(first.get<Reports>().receive(got)) << mark;
    EXPECT_EQ(got[0], mark);
    turn();
    turn();
  }
  EXPECT_FALSE(first.get<Reports>().receive(got));
  const auto whole = c->returned();
  EXPECT_EQ(whole->sequence, out);
  EXPECT_EQ(whole->actual, six.size());
  // To the host: until it has all that it asked for.
  const std::uint32_t in = c->submit({.endpoint = 1, .in = true, .length = 128});
  usb::Report report;
  report.fill(1);
  first.get<Reports>().send(report);
  EXPECT_EQ(c->unread(), 0u);
  report.fill(2);
  first.get<Reports>().send(report);
  const auto both = c->returned();
  EXPECT_EQ(both->sequence, in);
  ASSERT_EQ(both->data.size(), 128u);
  EXPECT_EQ(both->data[63], 1);
  EXPECT_EQ(both->data[64], 2);
  // Less room than a packet has.
  first.get<Reports>().send(report);
  c->submit({.endpoint = 1, .in = true, .length = 10});
  EXPECT_EQ(c->returned()->status, -75);
}

// The drive's device, but for packets to the host that come out shorter or longer.
class Crooked : public usbip::BusDevice {
 public:
  void reset() override { device.reset(); }
  void setup(std::span<const std::uint8_t, 8> bytes) override { device.setup(bytes); }
  usbip::Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& packet) override {
    const usbip::Handshake hand = device.in(endpoint, packet);
    const std::size_t to = endpoint == 0 ? control_bytes : report_bytes;
    if (hand == usbip::Handshake::ack && to != 0 && !packet.empty()) packet.resize(to);
    return hand;
  }
  usbip::Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> packet) override {
    return device.out(endpoint, packet);
  }
  HidDevice device{"CROOKED"};
  std::size_t control_bytes = 0, report_bytes = 0;  // zero: as they are
};

TEST_F(UsbIpServer, AShortPacketEndsATransferAndALongOneIsAnOverflow) {
  Crooked crooked;
  server.plug("1-3", crooked);
  auto c = attached("1-3");
  crooked.report_bytes = 10;
  for (const std::uint32_t flags : {0u, 1u}) {
    crooked.device.get<Reports>().send(usb::Report{});
    crooked.device.poll();
    c->submit({.endpoint = 1, .in = true, .length = 128, .flags = flags});
    const auto r = c->returned();
    EXPECT_EQ(r->status, flags == 0 ? 0 : kShort);
    EXPECT_EQ(r->actual, 10u);
  }
  crooked.control_bytes = 19;
  EXPECT_EQ(c->get(0x80, 6, 0x0100, 0, 18).status, -75);
  crooked.control_bytes = 0;
  EXPECT_EQ(c->get(0x80, 6, 0x0100, 0, 18).status, 0);
  c.reset();
  server.unplug("1-3");
}

TEST_F(UsbIpServer, ALaterTransferDoesNotOvertakeOneThatWaits) {
  usbip::Bus bus;
  HidDevice device{"X"};
  bus.plug("1-1", device);
  usbip::Connection talk(bus);
  talk.take(import_request("1-1"));
  talk.take(submit_bytes({.sequence = 1, .setup = UsbIpClient::setup(0x00, 9, 1, 0, 0)}));
  talk.output().clear();
  talk.take(submit_bytes({.sequence = 7, .endpoint = 1, .in = true, .length = 64}));
  device.get<Reports>().send(usb::Report{});
  device.poll();
  talk.take(submit_bytes({.sequence = 8, .endpoint = 1, .in = true, .length = 64}));
  talk.advance();
  ASSERT_EQ(talk.output().size(), 48u + 64u);
  EXPECT_EQ(get32(talk.output(), 4), 7u);
}

TEST_F(UsbIpServer, TakesBackATransferThatWaitsAndSaysSoWhereItHadEnded) {
  auto c = attached();
  const std::uint32_t waiting = c->submit({.endpoint = 1, .in = true, .length = 64});
  const std::uint32_t request = c->unlink(waiting);
  const auto gone = c->returned();
  EXPECT_EQ(gone->command, 4u);
  EXPECT_EQ(gone->sequence, request);
  EXPECT_EQ(gone->status, kUnlinked);
  const std::uint32_t ended = c->submit({.endpoint = 1, .data = report(1)});
  EXPECT_EQ(c->returned()->sequence, ended);
  c->unlink(ended);
  EXPECT_EQ(c->returned()->status, 0);
  // The report did not go to the transfer that was taken back.
  c->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(c->returned()->data, report(1));
}

TEST_F(UsbIpServer, AHaltedEndpointStallsUntilTheHostClearsIt) {
  auto c = attached();
  EXPECT_EQ(c->set(0x02, 3, 0, 0x81).status, 0);
  c->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(c->returned()->status, kStall);
  EXPECT_EQ(c->set(0x02, 1, 0, 0x81).status, 0);
  c->submit({.endpoint = 1, .data = report(3)});
  EXPECT_EQ(c->returned()->status, 0);
  c->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(c->returned()->data, report(3));
  c->submit({.endpoint = 9, .in = true, .length = 64});
  EXPECT_EQ(c->returned()->status, -2);
}

TEST_F(UsbIpServer, UnderstandsAStreamByteByByte) {
  auto c = client();
  for (const std::uint8_t byte : import_request("1-1")) c->send({byte});
  ASSERT_TRUE(c->receive(8 + 312));
  const Octets submit = submit_bytes({.in = true, .setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 18), .length = 18});
  for (const std::uint8_t byte : submit) c->send({byte});
  ASSERT_TRUE(c->receive(48 + 18));
  Octets several;
  for (int i = 0; i < 20; ++i) several.insert(several.end(), submit.begin(), submit.end());
  c->send(several);
  EXPECT_TRUE(c->receive(20 * (48 + 18)));
}

TEST_F(UsbIpServer, PulledOutItsClientIsCutOffAndPluggedInItWorksAgain) {
  auto c = attached("1-1");
  auto other = attached("1-2");
  c->submit({.endpoint = 1, .in = true, .length = 64});
  turn();
  EXPECT_TRUE(server.unplug("1-1"));
  EXPECT_FALSE(server.unplug("1-1"));
  EXPECT_TRUE(c->is_closed());
  EXPECT_FALSE(first.configured());
  EXPECT_EQ(client()->import("1-1"), 4);
  auto lister = client();
  lister->send(devlist_request());
  EXPECT_EQ(get32(*lister->receive(12), 8), 1u);
  other->submit({.endpoint = 1, .data = report(2)});
  EXPECT_EQ(other->returned()->status, 0);

  server.plug("1-1", first);
  auto again = attached("1-1");
  again->submit({.endpoint = 1, .data = report(4)});
  EXPECT_EQ(again->returned()->status, 0);
  again->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(again->returned()->data, report(4));
}

TEST_F(UsbIpServer, ADetachedHostLeavesNothingForTheNext) {
  echoes = false;
  auto c = attached();
  c->submit({.endpoint = 1, .data = report(9)});
  c->returned();
  usb::Report report{};
  first.get<Reports>().send(report);
  c->hang_up();
  for (int i = 0; i < 20; ++i) turn();
  EXPECT_FALSE(first.configured());
  auto next = attached();
  EXPECT_FALSE(first.get<Reports>().receive(report));
  next->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(next->unread(), 0u);
}

TEST_F(UsbIpServer, RefusesBusIdsAndDevicesThatAreNone) {
  for (const char* id : {"", "1", "1-", "-1", "0-1", "1-0", "1-x", "a-1", "1-1.1", "1-128", "99999-1", "1-1"})
    EXPECT_THROW(server.plug(id, second), std::invalid_argument) << id;
  struct Dead : usbip::BusDevice {
    void reset() override {}
    void setup(std::span<const std::uint8_t, 8>) override {}
    usbip::Handshake in(std::uint8_t, std::vector<std::uint8_t>&) override { return usbip::Handshake::nak; }
    usbip::Handshake out(std::uint8_t, std::span<const std::uint8_t>) override { return usbip::Handshake::nak; }
  } dead;
  EXPECT_THROW(server.plug("1-3", dead), std::invalid_argument);
  EXPECT_THROW(usbip::Server another(server.port()), std::runtime_error);
}

}  // namespace
}  // namespace flexspline::tests::usbip_server_test
