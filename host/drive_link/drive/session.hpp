// A drive that was opened and has identified itself: requests with their answers, telemetry as it comes.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/drive_link/transport/link.hpp"
#include "shared/protocol/commissioning_payloads.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::drive {

// What a drive refused or did not answer: which drive, what, and what to do.
class DriveError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using transport::Milliseconds;
using Bytes = std::vector<std::uint8_t>;

class Session {
 public:
  // Identifies the drive. Throws DriveError where nothing answers or versions do not agree, LinkError as the link does.
  // `answer`: how long a drive may take to answer before the request is repeated.
  explicit Session(std::unique_ptr<transport::Link> link, Milliseconds answer = Milliseconds(500));

  const protocol::Identity& identity() const { return identity_; }
  std::string name() const { return link_->name(); }
  std::string board() const;
  std::string serial() const;

  // The answer's payload. Asks again where no answer comes. Throws DriveError with the text of what was refused.
  template <class Answer = protocol::Empty, class Payload = protocol::Empty>
  Answer ask(protocol::Kind kind, const Payload& payload = {}) {
    const protocol::Message m = done(exchange(protocol::request(kind, 0, payload)));
    Answer answer{};
    if (protocol::take_payload(m.content(), answer) != protocol::Code::done) fail("its answer cannot be understood");
    return answer;
  }
  // The same, whatever its code.
  protocol::Message exchange(protocol::Message request);
  // The same, of a request that a drive refuses while its shaft moves: a drive that was just switched on checks its
  // sensors first, and then whether its shaft stands, so it is asked again for a while.
  protocol::Message exchange_at_rest(const protocol::Message& request);
  // The same; throws DriveError with the text of what was refused.
  protocol::Message ask_at_rest(const protocol::Message& request) { return done(exchange_at_rest(request)); }

  // What the board states of itself: nothing where the firmware is older than that.
  control::Hardware hardware();
  // What it knows of where its shafts are.
  protocol::Reference reference();
  // Sets the position of its motor, 2^-32 turns. Throws DriveError with the reason of a refusal.
  void home(std::int64_t position);
  // Throws DriveError with the reason of a refusal.
  void start_commissioning(const protocol::CommissioningBegin& request);
  protocol::Status status() { return ask<protocol::Status>(protocol::Kind::status); }
  protocol::Effects effects() { return ask<protocol::Effects>(protocol::Kind::effects); }
  // Throws DriveError with the reason of a refusal.
  protocol::CommandAnswer command(const protocol::Command& command);
  // Brings an armed drive to rest and disarms it; one that is not armed stays as it is. Never throws.
  void stop() noexcept;

  // Empty where there is none.
  Bytes read_block(protocol::Which which);
  // Stages, commits and reads back. progress(bytes sent) may throw to cancel.
  void write_block(const Bytes& block, const std::function<void(std::size_t)>& progress = {});
  // Returns the status after it.
  protocol::Status restore();
  // Both blocks, for good. The block in use stays active until the drive restarts.
  void erase_all_blocks();

  // From now on frames come, until an empty subscription.
  void subscribe(const std::vector<protocol::Channel>& channels, std::uint16_t every);
  // What came by itself or waits: a message of telemetry, or the answer to one that was posted. None after `limit`.
  std::optional<protocol::Message> next(Milliseconds limit);
  // Sends a request and leaves its answer to next(). Returns its number.
  std::uint8_t post(protocol::Message request);

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void wait_for_rest();
  protocol::CommandAnswer take_refusal(const protocol::Message& answer) const;
  protocol::Message done(const protocol::Message& answer) const;

  std::unique_ptr<transport::Link> link_;
  Milliseconds answer_;
  protocol::Identity identity_;
  std::deque<protocol::Message> unasked_;
  std::uint8_t number_ = 0;
};

}  // namespace flexspline::drive
