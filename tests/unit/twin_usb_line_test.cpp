// The drive's service behind its own USB device core: a message in each report, hosts one after another.
#include <gtest/gtest.h>

#include <memory>

#include "hil/twin/twin_drive.hpp"
#include "hil/twin/usb_line.hpp"
#include "tests/support/usbip_client.hpp"

namespace flexspline::tests::twin_usb_line_test {
namespace {

using protocol::Kind;

class UsbLine : public ::testing::Test {
 protected:
  // What flexspline-hil twin does, with a tick in the place of the time.
  void turn() {
    if (line.transfer(0)) {
      ++changes;
      drive.service().disconnected();
    }
    drive.tick();
    for (const protocol::Message* m = line.front(); m != nullptr && drive.service().take(*m); m = line.front())
      line.drop();
    protocol::Message m;
    while (line.has_room() && drive.service().next(m)) line.send(m);
  }
  std::unique_ptr<UsbIpClient> attached() {
    auto client = std::make_unique<UsbIpClient>(line.port(), [this] { turn(); });
    EXPECT_EQ(client->import(twin::UsbLine::kBusId), 0);
    EXPECT_EQ(client->set(0x00, 9, 1, 0).status, 0);
    turn();
    return client;
  }
  // The answer to a request, past what comes unasked.
  static protocol::Message ask(UsbIpClient& client, const protocol::Message& request) {
    const protocol::Report report = protocol::encode(request);
    client.submit({.endpoint = 1, .data = Octets(report.begin(), report.end())});
    EXPECT_EQ(client.returned().value().status, 0);
    for (int i = 0; i < 100; ++i) {
      client.submit({.endpoint = 1, .in = true, .length = 64});
      const auto got = client.returned();
      protocol::Message m{};
      if (!got || !protocol::decode(got->data, m)) break;
      if (!m.is_unasked()) return m;
    }
    ADD_FAILURE() << "no answer";
    return {};
  }
  static protocol::Code code(UsbIpClient& client, Kind kind) {
    const protocol::Message m = kind == Kind::identify ? protocol::request(kind, 7, protocol::Hello{})
                                                       : protocol::request(kind, 7, protocol::Empty{});
    const protocol::Message answer = ask(client, m);
    EXPECT_EQ(answer.kind, m.kind | protocol::kAnswerBit);
    EXPECT_EQ(answer.number, 7);
    return static_cast<protocol::Code>(answer.code);
  }

  twin::TwinDrive drive{[] {
    twin::TwinSetup setup;
    setup.drive = plant::demo_plant().drive;
    return setup;
  }()};
  twin::UsbLine line{0, "SN-1"};
  int changes = 0;
};

TEST_F(UsbLine, AnswersAHostInReports) {
  EXPECT_FALSE(line.has_host());
  auto host = attached();
  EXPECT_TRUE(line.has_host());
  EXPECT_EQ(code(*host, Kind::status), protocol::Code::wrong_version) << "nobody has said who he is";
  EXPECT_EQ(code(*host, Kind::identify), protocol::Code::done);
  EXPECT_EQ(code(*host, Kind::status), protocol::Code::done);
}

TEST_F(UsbLine, AReportThatHoldsNoMessageIsPassedOver) {
  auto host = attached();
  Octets nonsense(64, 0xff);
  host->submit({.endpoint = 1, .data = nonsense});
  EXPECT_EQ(host->returned().value().status, 0);
  EXPECT_EQ(code(*host, Kind::identify), protocol::Code::done);
}

TEST_F(UsbLine, AHostThatGoesIsLostAndTheNextOneHasToSayWhoItIs) {
  auto host = attached();
  EXPECT_EQ(code(*host, Kind::identify), protocol::Code::done);
  const int before = changes;
  host->hang_up();
  for (int i = 0; i < 200 && line.has_host(); ++i) turn();
  EXPECT_FALSE(line.has_host());
  EXPECT_GT(changes, before);
  // Without a host what is sent does not wait for the next one.
  EXPECT_TRUE(line.has_room());
  for (int i = 0; i < 100; ++i) line.send(protocol::request(Kind::status, 1, protocol::Empty{}));
  host = attached();
  EXPECT_EQ(code(*host, Kind::status), protocol::Code::wrong_version);
  EXPECT_EQ(code(*host, Kind::identify), protocol::Code::done);
}

TEST_F(UsbLine, ConfiguringTheDeviceAwayIsGoing) {
  auto host = attached();
  EXPECT_EQ(code(*host, Kind::identify), protocol::Code::done);
  EXPECT_EQ(host->set(0x00, 9, 0, 0).status, 0);
  turn();
  EXPECT_FALSE(line.has_host());
  EXPECT_EQ(host->set(0x00, 9, 1, 0).status, 0);
  turn();
  EXPECT_EQ(code(*host, Kind::status), protocol::Code::wrong_version);
}

TEST_F(UsbLine, AHostThatDoesNotReadLeavesRoomForNothingMore) {
  auto host = attached();
  EXPECT_TRUE(line.has_room());
  int sent = 0;
  for (; line.has_room() && sent < 100; ++sent) line.send(protocol::request(Kind::status, 1, protocol::Empty{}));
  EXPECT_GE(sent, 16);
  EXPECT_LE(sent, 17) << "one more than wait may be on its way";
}

}  // namespace
}  // namespace flexspline::tests::twin_usb_line_test
