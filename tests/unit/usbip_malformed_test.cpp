// What a USB/IP client may get wrong, by mistake or not: only its own conversation ends.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hil/usbip/core_device.hpp"
#include "hil/usbip/server.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"
#include "tests/support/usbip_client.hpp"

namespace flexspline::tests::usbip_malformed_test {
namespace {

using Reports = usb::Hid<8, 4>;
using HidDevice = usbip::CoreDevice<usb::FlexsplineIdentity, Reports>;

class UsbIpMalformed : public ::testing::Test {
 protected:
  UsbIpMalformed() {
    server.plug("1-1", device);
    server.plug("1-2", witness_device);
    witness = client();
    EXPECT_EQ(witness->import("1-2"), 0);
  }
  // Whatever another client does, this one is served.
  void TearDown() override { EXPECT_EQ(witness->get(0x80, 6, 0x0100, 0, 18).actual, 18u); }
  std::unique_ptr<UsbIpClient> client() {
    return std::make_unique<UsbIpClient>(server.port(), [this] { server.serve(1); });
  }

  HidDevice device{"A"}, witness_device{"B"};
  usbip::Server server{0};
  std::unique_ptr<UsbIpClient> witness;
};

TEST_F(UsbIpMalformed, OperationsThatAreNoneEndTheConversation) {
  const Octets good_submit = submit_bytes({.in = true, .length = 18});
  const std::vector<std::pair<const char*, Octets>> wrong{
      {"version", {0x01, 0x10, 0x80, 0x05, 0, 0, 0, 0}},
      {"code", {0x01, 0x11, 0x80, 0x06, 0, 0, 0, 0}},
      {"a reply", {0x01, 0x11, 0x00, 0x05, 0, 0, 0, 0}},
      {"a transfer before an import", good_submit},
      {"another protocol", {'G', 'E', 'T', ' ', '/', ' ', 'H', 'T', 'T', 'P', '/', '1', '.', '0', '\r', '\n'}},
  };
  std::uint64_t faults = 0;
  for (const auto& [what, bytes] : wrong) {
    auto c = client();
    c->send(bytes);
    EXPECT_TRUE(c->is_closed()) << what;
    EXPECT_EQ(server.faults(), ++faults) << what;
  }
  // A bus id without an end is none.
  auto c = client();
  Octets bytes = import_request("");
  for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = '1';
  c->send(bytes);
  const auto reply = c->receive(8);
  ASSERT_TRUE(reply);
  EXPECT_EQ(get32(*reply, 4), 4u);
  EXPECT_TRUE(c->is_closed());
}

TEST_F(UsbIpMalformed, CommandsThatMakeNoSenseEndTheConversationAndFreeTheDevice) {
  const auto changed = [](std::size_t at, std::uint32_t value) {
    Octets bytes = submit_bytes({.in = true, .setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 18), .length = 18});
    set32(bytes, at, value);
    return bytes;
  };
  const std::vector<std::pair<const char*, Octets>> wrong{
      {"no command", changed(0, 0)},
      {"a reply", changed(0, 3)},
      {"another device", changed(8, 0x00010002)},
      {"no direction", changed(12, 2)},
      {"no endpoint", changed(16, 16)},
      {"endpoint with direction", changed(16, 0x81)},
      {"a negative length", changed(24, 0xffffffff)},
      {"a length beyond all", changed(24, 0x7fffffff)},
      {"isochronous", changed(32, 3)},
      {"an operation", devlist_request()},
  };
  std::uint64_t faults = 0;
  for (const auto& [what, bytes] : wrong) {
    auto c = client();
    ASSERT_EQ(c->import("1-1"), 0) << what;
    EXPECT_EQ(c->get(0x80, 6, 0x0100, 0, 18).actual, 18u);
    Octets padded = bytes;
    padded.resize(48);
    c->send(padded);
    EXPECT_TRUE(c->is_closed()) << what;
    EXPECT_EQ(server.faults(), ++faults) << what;
    EXPECT_FALSE(server.imported("1-1")) << what;
  }
}

TEST_F(UsbIpMalformed, AStreamThatEndsEarlyIsNoticed) {
  // Half closed after a whole request: the answer still comes.
  auto asks = client();
  asks->send(devlist_request());
  asks->end_sending();
  EXPECT_TRUE(asks->receive(12 + 2 * 316));
  EXPECT_TRUE(asks->is_closed());
  EXPECT_EQ(server.faults(), 0u);

  auto breaks_off = client();
  breaks_off->send({0x01, 0x11, 0x80});
  breaks_off->end_sending();
  EXPECT_TRUE(breaks_off->is_closed());
  EXPECT_EQ(server.faults(), 1u);

  auto c = client();
  ASSERT_EQ(c->import("1-1"), 0);
  Octets bytes = submit_bytes({.endpoint = 1, .data = Octets(64)});
  bytes.resize(100);  // within its data
  c->send(bytes);
  c->end_sending();
  EXPECT_TRUE(c->is_closed());
  EXPECT_EQ(server.faults(), 2u);
  EXPECT_FALSE(server.imported("1-1"));

  auto leaves = client();
  ASSERT_EQ(leaves->import("1-1"), 0);
  leaves->end_sending();
  EXPECT_TRUE(leaves->is_closed());
  EXPECT_EQ(server.faults(), 2u);
  EXPECT_FALSE(server.imported("1-1"));
}

TEST_F(UsbIpMalformed, WhoAsksForTooMuchAtOnceIsSentAway) {
  auto c = client();
  ASSERT_EQ(c->import("1-1"), 0);
  ASSERT_EQ(c->set(0x00, 9, 1, 0).status, 0);
  for (std::size_t i = 0; i < usbip::Connection::kMostPending; ++i)
    c->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_EQ(c->unread(), 0u);
  EXPECT_TRUE(server.imported("1-1"));
  c->submit({.endpoint = 1, .in = true, .length = 64});
  EXPECT_TRUE(c->is_closed());
  EXPECT_EQ(server.faults(), 1u);
}

TEST_F(UsbIpMalformed, AClientThatNeverReadsIsNotListenedToForEver) {
  usbip::Bus bus;
  HidDevice another{"C"};
  bus.plug("1-1", another);
  usbip::Connection talk(bus);
  talk.take(import_request("1-1"));
  const Octets request = submit_bytes({.in = true, .setup = UsbIpClient::setup(0x80, 6, 0x0100, 0, 18), .length = 18});
  for (int i = 0; i < 1'000'000 && talk.wants_input(); ++i) talk.take(request);
  EXPECT_FALSE(talk.wants_input());
  EXPECT_FALSE(talk.finished());
  EXPECT_LT(talk.output().size(), 2 * usbip::Connection::kMostOutput);
  talk.output().clear();
  EXPECT_TRUE(talk.wants_input());
}

TEST_F(UsbIpMalformed, MoreClientsThanPlacesAreSentAway) {
  std::vector<std::unique_ptr<UsbIpClient>> clients;
  while (server.connections() < usbip::Server::kMostConnections) {
    clients.push_back(client());
    server.serve(1);
  }
  auto one_more = client();
  EXPECT_TRUE(one_more->is_closed());
  clients.pop_back();
  for (int i = 0; i < 10; ++i) server.serve(1);
  EXPECT_EQ(client()->import("1-1"), 0);
}

TEST_F(UsbIpMalformed, WhoSaysNothingIsSentAwayButNotWhoHasADevice) {
  auto silent = client();
  auto user = client();
  ASSERT_EQ(user->import("1-1"), 0);
  server.set_idle_limit(std::chrono::milliseconds(20));
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  EXPECT_TRUE(silent->is_closed());
  EXPECT_EQ(server.faults(), 1u);
  EXPECT_EQ(user->get(0x80, 6, 0x0100, 0, 18).actual, 18u);
}

// Each field of a good conversation changed at random, in pieces of random length.
TEST_F(UsbIpMalformed, DamagedConversationsDoNoHarm) {
  std::mt19937 random(11);
  int survived = 0;
  for (int round = 0; round < 3000; ++round) {
    usbip::Bus bus;
    HidDevice another{"C"};
    bus.plug("1-1", another);
    Octets stream = import_request("1-1");
    const auto add = [&](const Octets& bytes) { stream.insert(stream.end(), bytes.begin(), bytes.end()); };
    add(submit_bytes({.setup = UsbIpClient::setup(0x00, 9, 1, 0, 0)}));
    add(submit_bytes({.endpoint = 1, .in = true, .length = 64}));
    add(submit_bytes({.endpoint = 1, .data = Octets(64, 1)}));
    add(submit_bytes({.setup = UsbIpClient::setup(0x21, 9, 0x0200, 0, 64), .data = Octets(64, 2)}));
    add(unlink_bytes(9, 1));
    for (unsigned i = random() % 4; i > 0; --i)
      stream[40 + random() % (stream.size() - 40)] = static_cast<std::uint8_t>(random());
    usbip::Connection talk(bus);
    for (std::size_t at = 0; at < stream.size() && !talk.finished();) {
      const std::size_t n = std::min<std::size_t>(1 + random() % 100, stream.size() - at);
      talk.take(std::span(stream).subspan(at, n));
      talk.advance();
      at += n;
    }
    EXPECT_LT(talk.output().size(), 100'000u);
    EXPECT_EQ(talk.finished(), !talk.fault().empty());
    survived += talk.finished() ? 0 : 1;
  }
  EXPECT_GT(survived, 500);
  EXPECT_LT(survived, 2900);
}

}  // namespace
}  // namespace flexspline::tests::usbip_malformed_test
