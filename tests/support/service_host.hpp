// A host and a twin in one process: sends requests and lets time pass until the answer comes.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <vector>

#include "hil/twin/twin_drive.hpp"

namespace flexspline::tests {

class ServiceHost {
 public:
  explicit ServiceHost(twin::TwinDrive& drive) : drive_(drive) {}

  template <class Payload>
  protocol::Message ask(protocol::Kind kind, const Payload& payload) {
    return ask(protocol::request(kind, ++number_, payload));
  }
  protocol::Message ask(protocol::Kind kind) { return ask(kind, protocol::Empty{}); }
  protocol::Message ask(const protocol::Message& request) {
    EXPECT_TRUE(drive_.service().take(request));
    for (int ticks = 0; ticks < 50; ++ticks) {
      protocol::Message m;
      while (drive_.service().next(m)) {
        if (m.is_unasked()) {
          frames.push_back(m);
        } else {
          EXPECT_EQ(m.kind, request.kind | protocol::kAnswerBit);
          EXPECT_EQ(m.number, request.number);
          return m;
        }
      }
      drive_.tick();
    }
    ADD_FAILURE() << "no answer to a request of kind " << int{request.kind};
    return {};
  }
  template <class Payload>
  protocol::Code code(protocol::Kind kind, const Payload& payload) {
    return static_cast<protocol::Code>(ask(kind, payload).code);
  }
  protocol::Code code(protocol::Kind kind) { return code(kind, protocol::Empty{}); }

  protocol::Code identify() { return code(protocol::Kind::identify, protocol::Hello{}); }
  protocol::Status status() {
    protocol::Status s;
    EXPECT_EQ(protocol::take_payload(ask(protocol::Kind::status).content(), s), protocol::Code::done);
    return s;
  }
  protocol::CommandAnswer command(const protocol::Command& c) {
    protocol::CommandAnswer answer;
    EXPECT_EQ(protocol::take_payload(ask(protocol::Kind::command, c).content(), answer), protocol::Code::done);
    return answer;
  }
  protocol::CommandAnswer arm(protocol::Mode mode) {
    return command({.kind = protocol::CommandKind::arm, .mode = mode});
  }
  // Stages a block; the code of the first request that is not done, or of the commit.
  protocol::Code flash(const std::vector<std::uint8_t>& block, std::uint32_t* reason = nullptr) {
    using protocol::Code, protocol::Kind;
    Code c =
        code(Kind::block_begin, protocol::BlockBegin{static_cast<std::uint32_t>(block.size()), model::crc32(block)});
    for (std::size_t at = 0; c == Code::done && at < block.size(); at += protocol::kMostChunk) {
      protocol::Chunk chunk;
      chunk.offset = static_cast<std::uint32_t>(at);
      chunk.count = static_cast<std::uint8_t>(std::min(protocol::kMostChunk, block.size() - at));
      std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(at), chunk.count, chunk.bytes.begin());
      c = code(Kind::block_chunk, chunk);
    }
    if (c != Code::done) return c;
    const protocol::Message m = ask(Kind::block_commit);
    protocol::Reason payload;
    if (protocol::take_payload(m.content(), payload) == Code::done && reason != nullptr) *reason = payload.reason;
    return static_cast<Code>(m.code);
  }
  std::vector<std::uint8_t> read(protocol::Which which) {
    std::vector<std::uint8_t> block;
    for (;;) {
      protocol::Chunk chunk;
      const auto offset = static_cast<std::uint32_t>(block.size());
      const protocol::Message m = ask(protocol::Kind::block_read, protocol::BlockRead{which, offset});
      if (m.code != 0 || protocol::take_payload(m.content(), chunk) != protocol::Code::done || chunk.count == 0)
        return block;
      block.insert(block.end(), chunk.bytes.begin(), chunk.bytes.begin() + chunk.count);
    }
  }

  std::vector<protocol::Message> frames;

 private:
  twin::TwinDrive& drive_;
  std::uint8_t number_ = 0;
};

}  // namespace flexspline::tests
