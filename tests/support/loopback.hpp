// The host's session with a drive's own service, in one process: time passes while the host waits. The line between
// them loses and changes what the test says.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>

#include "hil/twin/twin_drive.hpp"
#include "host/drive_link/drive/session.hpp"

namespace flexspline::tests {

// Decides of each answer whether it is lost; may change it.
using OnAnswer = std::function<bool(protocol::Message&)>;

class Loopback : public transport::Link {
 public:
  Loopback(twin::TwinDrive& drive, OnAnswer on_answer) : drive_(drive), on_answer_(std::move(on_answer)) {}
  void send(const protocol::Message& m) override {
    protocol::Message arrived;
    ASSERT_TRUE(protocol::decode(protocol::encode(m), arrived));
    while (!drive_.service().take(arrived)) drive_.tick();
  }
  // A tick lasts a millisecond at most, so that limits of time are not waited for.
  std::optional<protocol::Message> receive(transport::Milliseconds limit) override {
    for (auto i = 0; i < 20 * std::min<long>(limit.count(), 20); ++i) {
      protocol::Message m;
      if (drive_.service().next(m)) {
        if (m.is_unasked() || !on_answer_ || !on_answer_(m)) return m;
      }
      drive_.tick();
    }
    return {};
  }
  std::string name() const override { return "loopback"; }

 private:
  twin::TwinDrive& drive_;
  OnAnswer on_answer_;
};

inline drive::Session open_session(twin::TwinDrive& drive, OnAnswer on_answer = {}) {
  drive.run(200);
  return drive::Session(std::make_unique<Loopback>(drive, std::move(on_answer)), drive::Milliseconds(50));
}

}  // namespace flexspline::tests
