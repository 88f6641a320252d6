#include "firmware/report_link.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "hil/twin/twin_drive.hpp"

namespace flexspline::firmware_report_link_test {
namespace {

using protocol::Code;
using protocol::Kind;

// Endpoints with queues, as a USB device has them.
struct Reports {
  std::deque<protocol::Report> from_host, to_host;
  std::size_t places = 4;
  bool receive(protocol::Report& report) {
    if (from_host.empty()) return false;
    report = from_host.front();
    from_host.pop_front();
    return true;
  }
  std::size_t room() const { return places - to_host.size(); }
  bool send(const protocol::Report& report) {
    to_host.push_back(report);
    return true;
  }
};
struct Bench {
  twin::TwinDrive drive{{.drive = plant::demo_plant().drive}};
  Reports reports;
  firmware::ReportLink<twin::TwinDrive::Service, Reports> link{drive.service(), reports};
  bool connected = true;
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      drive.tick();
      link.poll(connected);
    }
  }
  template <class Payload>
  void ask(Kind kind, std::uint8_t number, const Payload& payload) {
    reports.from_host.push_back(protocol::encode(protocol::request(kind, number, payload)));
  }
  protocol::Message next() {
    protocol::Message m;
    EXPECT_FALSE(reports.to_host.empty());
    if (reports.to_host.empty()) return m;
    EXPECT_TRUE(protocol::decode(reports.to_host.front(), m));
    reports.to_host.pop_front();
    return m;
  }
};

TEST(ReportLink, AnswersRequestsInTheirOrderHoweverFastTheyCome) {
  Bench b;
  b.run(100);
  b.ask(Kind::identify, 1, protocol::Hello{});
  b.reports.from_host.push_back({0x01, 0x02, 0xFF});  // no message
  for (std::uint8_t n = 2; n < 10; ++n) b.ask(Kind::status, n, protocol::Empty{});
  for (std::uint8_t n = 1; n < 10; ++n) {
    b.run(20);
    const protocol::Message m = b.next();
    EXPECT_EQ(m.number, n);
    EXPECT_EQ(static_cast<Code>(m.code), Code::done);
  }
  EXPECT_TRUE(b.reports.to_host.empty());
}

TEST(ReportLink, ANewHostHasToIdentifyItselfAndGetsNoTelemetryOfTheOneBefore) {
  Bench b;
  b.run(100);
  b.ask(Kind::identify, 1, protocol::Hello{});
  b.ask(Kind::telemetry, 2, protocol::Subscription{20, {protocol::Channel::current}, 1});
  b.run(1000);
  b.next(), b.next();
  EXPECT_TRUE(b.next().is_unasked());
  b.connected = false;
  b.run(10);
  b.reports.to_host.clear();
  b.connected = true;
  b.run(2000);
  EXPECT_TRUE(b.reports.to_host.empty());
  b.ask(Kind::status, 3, protocol::Empty{});
  b.run(10);
  EXPECT_EQ(static_cast<Code>(b.next().code), Code::wrong_version);
}

// A host that does not poll: its reports fill up, then the drive's ring, which counts what finds no room.
TEST(ReportLink, AHostThatDoesNotPollLosesFramesThatAreCountedAndNoAnswer) {
  Bench b;
  b.run(100);
  b.ask(Kind::identify, 1, protocol::Hello{});
  b.run(10);
  b.ask(Kind::telemetry, 2, protocol::Subscription{1, {protocol::Channel::current}, 1});
  b.run(20'000);
  b.ask(Kind::status, 3, protocol::Empty{});
  b.run(10);
  std::uint32_t frames = 0, lost = 0, next = 0;
  protocol::Status status;
  for (int i = 0; i < 3'000 && status.tick == 0; ++i) {
    b.run(1);
    if (b.reports.to_host.empty()) continue;
    const protocol::Message m = b.next();
    if (m.is_unasked()) {
      protocol::for_each_frame(m, [&](const auto& head, std::uint32_t k, auto) {
        lost += head.sequence + k - next;
        next = head.sequence + k + 1;
        ++frames;
      });
    } else if (m.request() == Kind::status) {
      ASSERT_EQ(protocol::take_payload(m.content(), status), Code::done);
    }
  }
  EXPECT_GT(status.dropped, 15'000U);
  EXPECT_GT(frames, 0U);
  EXPECT_EQ(lost, 0U) << "what was in the queues is from before the gap";
}

}  // namespace
}  // namespace flexspline::firmware_report_link_test
