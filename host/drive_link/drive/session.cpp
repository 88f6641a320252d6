#include "host/drive_link/drive/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "shared/fixed/types.hpp"
#include "shared/model/block_texts.hpp"
#include "shared/model/encoding.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::drive {
namespace {

using protocol::Code;
using protocol::Kind;
using Clock = std::chrono::steady_clock;

constexpr Milliseconds kErase{6000};  // of a sector, by the data sheets of usual parts 2 s
constexpr int kTries = 4;
constexpr Milliseconds kBusy{1000};

std::string text_in(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t b : bytes) {
    if (b == 0) break;
    text += b >= 0x20 && b < 0x7F ? static_cast<char>(b) : '?';
  }
  return text;
}

}  // namespace

Session::Session(std::unique_ptr<transport::Link> link, Milliseconds answer) : link_(std::move(link)), answer_(answer) {
  protocol::Message m;
  try {
    m = exchange(protocol::request(Kind::identify, 0, protocol::Hello{}));
  } catch (const DriveError&) {
    fail("nothing there answers as a drive does; is it a Flexspline drive, and does its firmware run?");
  }
  // Of older firmware: not stated.
  if (m.length >= protocol::kIdentityBytesBeforeKey)
    for (; m.length < protocol::kIdentityBytes; ++m.length) m.payload[m.length] = 0;
  if (protocol::take_front(m.content(), identity_) != Code::done) fail("what answers there is not a drive");
  if (identity_.major != protocol::kMajor)
    fail(fmt::format("its firmware speaks version {} of the protocol, this tool version {}; bring {} up to date",
                     identity_.major, protocol::kMajor,
                     identity_.major < protocol::kMajor ? "the firmware" : "this tool"));
}

control::Hardware Session::hardware() {
  if (identity_.minor < protocol::kMinorOfHardware) return {};
  return ask<protocol::Hardware>(Kind::hardware).board;
}

protocol::Reference Session::reference() {
  if (identity_.minor < protocol::kMinorOfHardware)
    fail("its firmware is older than position references; bring the firmware up to date");
  protocol::Message m = done(exchange(protocol::request(Kind::reference, 0, protocol::Empty{})));
  protocol::Reference known;
  if (m.length == protocol::kReferenceBytesBeforeZero)
    for (; m.length < protocol::kReferenceBytes; ++m.length) m.payload[m.length] = 0;
  if (protocol::take_payload(m.content(), known) != Code::done) fail("its answer cannot be understood");
  return known;
}

void Session::home(std::int64_t position) {
  if (identity_.minor < protocol::kMinorOfHardware)
    fail("its firmware is older than position references; bring the firmware up to date");
  take_refusal(exchange_at_rest(protocol::request(Kind::home, 0, protocol::Home{position})));
}

void Session::start_commissioning(const protocol::CommissioningBegin& request) {
  take_refusal(exchange_at_rest(protocol::request(Kind::commissioning_begin, 0, request)));
}

protocol::Message Session::exchange_at_rest(const protocol::Message& request) {
  constexpr int kMostAttempts = 100, kMostWhileMoving = 20;
  for (int attempt = 1;; ++attempt) {
    const protocol::Message answer = exchange(request);
    const auto code = static_cast<Code>(answer.code);
    protocol::CommandAnswer refused;
    const bool is_refused = code == Code::refused && protocol::take_payload(answer.content(), refused) == Code::done;
    const bool boots = is_refused && refused.refusal == protocol::Refusal::booting;
    const bool moves = code == Code::moving || (is_refused && refused.refusal == protocol::Refusal::moving);
    if (attempt == kMostAttempts || !(boots || (moves && attempt < kMostWhileMoving))) return answer;
    std::this_thread::sleep_for(Milliseconds(10));
  }
}

void Session::erase_all_blocks() {
  if (identity_.minor < protocol::kMinorOfHardware)
    fail("its firmware is older than the factory reset; bring the firmware up to date");
  ask_at_rest(protocol::request(Kind::block_erase_all, 0, protocol::Empty{}));
}

std::string Session::board() const {
  return text_in(identity_.board);
}
std::string Session::serial() const {
  return text_in(identity_.serial);
}

void Session::fail(const std::string& what) const {
  throw DriveError(fmt::format("{}: {}", link_->name(), what));
}

protocol::Message Session::done(const protocol::Message& answer) const {
  const auto code = static_cast<Code>(answer.code);
  if (code != Code::done) fail(std::string(protocol::text_of(code)));
  return answer;
}

std::uint8_t Session::post(protocol::Message request) {
  request.number = ++number_;
  link_->send(request);
  return request.number;
}

protocol::Message Session::exchange(protocol::Message request) {
  const bool erases = request.request() == Kind::block_begin || request.request() == Kind::block_erase_all;
  const auto busy_until = Clock::now() + kBusy;
  for (int tries = 0; tries < (erases ? 1 : kTries); ++tries) {
    const std::uint8_t number = post(request);
    const auto end = Clock::now() + (erases ? kErase : answer_);
    while (Clock::now() < end) {
      const auto m = link_->receive(std::chrono::duration_cast<Milliseconds>(end - Clock::now()) + Milliseconds(1));
      if (!m) continue;
      if (m->is_unasked()) {
        unasked_.push_back(*m);
        continue;
      }
      // Answers to requests that were given up are passed over.
      if (m->number != number || m->kind != (request.kind | protocol::kAnswerBit)) continue;
      if (static_cast<Code>(m->code) != Code::busy || Clock::now() > busy_until) return *m;
      --tries;
      std::this_thread::sleep_for(Milliseconds(2));
      break;
    }
  }
  fail("the drive does not answer any more; check cable and power, then try again");
}

std::optional<protocol::Message> Session::next(Milliseconds limit) {
  if (!unasked_.empty()) {
    const protocol::Message m = unasked_.front();
    unasked_.pop_front();
    return m;
  }
  return link_->receive(limit);
}

protocol::CommandAnswer Session::command(const protocol::Command& command) {
  return take_refusal(exchange(protocol::request(Kind::command, 0, command)));
}

protocol::CommandAnswer Session::take_refusal(const protocol::Message& m) const {
  protocol::CommandAnswer answer;
  const bool has_reason = protocol::take_payload(m.content(), answer) == Code::done;
  if (static_cast<Code>(m.code) == Code::refused && has_reason) fail(std::string(protocol::text_of(answer.refusal)));
  done(m);
  return answer;
}

void Session::stop() noexcept {
  try {
    const protocol::Mode mode = command({}).mode;
    if (!protocol::is_armed(mode)) return;
    if (mode != protocol::Mode::stop) command({.kind = protocol::CommandKind::arm, .mode = protocol::Mode::velocity});
    wait_for_rest();
    if (protocol::is_armed(command({}).mode)) command({.kind = protocol::CommandKind::disarm});
  } catch (const std::exception&) {
    // A drive that does not hear its host stops by itself.
  }
}

// Until the drive's own deceleration has brought it to rest, at most a second: more than any takes.
void Session::wait_for_rest() {
  constexpr std::uint16_t kEveryMs = 10;
  constexpr std::int32_t kSlow = std::int32_t{1} << (fixed::kValueBits - 8);  // of the base of velocity
  subscribe({protocol::Channel::velocity, protocol::Channel::state},
            static_cast<std::uint16_t>(std::clamp<std::uint32_t>(identity_.tick_hz / 1000 * kEveryMs, 1, 65535)));
  const auto end = Clock::now() + std::chrono::seconds(1);
  auto reported_at = Clock::now();
  int slow = 0;
  while (slow < 3 && Clock::now() < end) {
    const auto m = next(Milliseconds(kEveryMs));
    if (m && m->is_unasked())
      protocol::for_each_frame(*m, [&](const auto&, auto, std::span<const std::uint32_t> words) {
        const auto velocity = static_cast<std::int32_t>(words[0]);
        const bool armed = protocol::is_armed(static_cast<protocol::Mode>(words[1] & 0xFF));
        slow = !armed ? 3 : velocity > -kSlow && velocity < kSlow ? slow + 1 : 0;
      });
    // A sign of the host, by its clock or by the drive's.
    if (!m && Clock::now() - reported_at < Milliseconds(20)) continue;
    command({});
    reported_at = Clock::now();
  }
}

Bytes Session::read_block(protocol::Which which) {
  Bytes block;
  for (;;) {
    const protocol::BlockRead wanted{which, static_cast<std::uint32_t>(block.size())};
    const protocol::Message m = exchange(protocol::request(Kind::block_read, 0, wanted));
    if (static_cast<Code>(m.code) == Code::no_block) return {};
    protocol::Chunk chunk;
    if (protocol::take_payload(done(m).content(), chunk) != Code::done || chunk.offset != block.size())
      fail("what it sends is not a part of its block; try again");
    if (chunk.count == 0) return block;
    block.insert(block.end(), chunk.bytes.begin(), chunk.bytes.begin() + chunk.count);
    if (block.size() > identity_.block_bytes) fail("its block is longer than the limit that it states");
  }
}

void Session::write_block(const Bytes& block, const std::function<void(std::size_t)>& progress) {
  const std::uint32_t crc = model::crc32(block);
  const protocol::BlockBegin begin{static_cast<std::uint32_t>(block.size()), crc};
  ask_at_rest(protocol::request(Kind::block_begin, 0, begin));
  for (std::size_t at = 0; at < block.size();) {
    protocol::Chunk chunk;
    chunk.offset = static_cast<std::uint32_t>(at);
    chunk.count = static_cast<std::uint8_t>(std::min(protocol::kMostChunk, block.size() - at));
    std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(at), chunk.count, chunk.bytes.begin());
    ask(Kind::block_chunk, chunk);
    at += chunk.count;
    if (progress) progress(at);
  }
  const protocol::Message m = exchange(protocol::request(Kind::block_commit, 0, protocol::Empty{}));
  const auto code = static_cast<Code>(m.code);
  if (code == Code::invalid) {
    protocol::Reason reason;
    protocol::take_payload(m.content(), reason);
    fail(fmt::format("{}: {}", protocol::text_of(code), model::text_of(static_cast<model::BlockFault>(reason.reason))));
  }
  // A commit that was done and whose answer got lost is no more there to be done again.
  const protocol::Status now = status();
  const bool is_active = now.active.bytes == block.size() && now.active.crc == crc;
  if (code != Code::done && !(code == Code::not_begun && is_active)) fail(std::string(protocol::text_of(code)));
  if (!is_active || read_block(protocol::Which::active) != block)
    fail("the block reads back as another one; try again, and if it stays the drive's flash memory is worn out");
}

protocol::Status Session::restore() {
  const protocol::Status before = status();
  if (before.previous.bytes == 0) fail(std::string(protocol::text_of(Code::no_previous)));
  ask_at_rest(protocol::request(Kind::block_restore, 0, protocol::BlockRestore{before.sequence}));
  const protocol::Status after = status();
  if (after.active != before.previous) fail("another block is active than the one before; try again");
  return after;
}

void Session::subscribe(const std::vector<protocol::Channel>& channels, std::uint16_t every) {
  if (channels.size() > identity_.most_channels || channels.size() > protocol::kMostChannels)
    fail(fmt::format("it records at most {} channels, not {}", identity_.most_channels, channels.size()));
  protocol::Subscription wanted;
  wanted.every = every;
  wanted.count = static_cast<std::uint8_t>(channels.size());
  std::copy(channels.begin(), channels.end(), wanted.channels.begin());
  ask(Kind::telemetry, wanted);
  unasked_.clear();  // frames of the one before
}

}  // namespace flexspline::drive
