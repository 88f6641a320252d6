// Locks the parameters of a drive that is paired with a key: what writes is refused until the host has signed a
// challenge (shared/protocol/pairing_payloads.hpp). For background work only; the tick does not know of it.
//
// The drive knows no secret. A challenge never repeats: the number of the start is recorded in flash memory before it
// is used, and random numbers of the board are mixed in, so that nobody knows it before.
#pragma once

#include <array>
#include <cstdint>

#include "firmware/board.hpp"
#include "shared/boot/signature/ed25519.hpp"
#include "shared/protocol/access.hpp"
#include "shared/protocol/pairing_payloads.hpp"
#include "shared/storage/pairing_memory.hpp"

namespace flexspline::firmware {

// For a board without memory for a key.
struct NoLock {
  void start(const protocol::DriveName&) {}
  bool admits(const protocol::Message&, std::uint32_t) const { return true; }
  protocol::PairingState state() const { return protocol::PairingState::none; }
  protocol::Pairing info() const { return {}; }
  protocol::Code challenge(std::uint32_t, protocol::PairingChallenge&) const { return protocol::Code::not_available; }
  protocol::Code take(const protocol::PairingPart&) const { return protocol::Code::not_available; }
  protocol::Code take(const protocol::PairingAnswer&, std::uint32_t) const { return protocol::Code::not_available; }
  protocol::Code remove() const { return protocol::Code::not_available; }
  void close() {}
  void watch(std::uint32_t) {}
};

template <class Memory, Board B>
class ParameterLock {
 public:
  // A host that is silent for so long, as far as writing goes, has to answer another challenge.
  static constexpr std::uint32_t kOpenS = 60;
  // After a wrong signature; twice as long after each further one.
  static constexpr std::uint32_t kFirstWaitS = 1, kMostWaitS = 64;

  ParameterLock(Memory& memory, B& board) : memory_(memory), board_(board) {}

  // Before the first tick. `drive`: as `identify` states it.
  void start(const protocol::DriveName& drive) {
    drive_ = drive;
    memory_.boot();
  }
  // Whether a request may be served. One that writes keeps the lock open.
  bool admits(const protocol::Message& m, std::uint32_t tick) {
    if (!memory_.is_paired() || protocol::access_of(m.request()) != protocol::Access::writes) return true;
    if (is_open_) opened_at_ = tick;
    return is_open_;
  }
  protocol::PairingState state() const {
    using State = protocol::PairingState;
    return !memory_.is_paired() ? State::not_paired : is_open_ ? State::open : State::locked;
  }
  protocol::Pairing info() const {
    const std::uint32_t left = wait_ticks_ == 0 ? 0 : wait_ticks_ - waited_;
    return {state(), left / (tick_hz() / 1000), memory_.key()};
  }

  protocol::Code challenge(std::uint32_t tick, protocol::PairingChallenge& out) {
    has_nonce_ = false;
    if (wait_ticks_ > 0) return protocol::Code::wait;
    std::uint32_t start = 0;
    if (!memory_.start_number(start)) return protocol::Code::pairing_full;
    ed25519::Sha512 hash;
    const auto add = [&](std::uint32_t word) {
      const std::array<std::uint8_t, 4> bytes{static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8),
                                              static_cast<std::uint8_t>(word >> 16),
                                              static_cast<std::uint8_t>(word >> 24)};
      hash.add(bytes);
    };
    hash.add(drive_.serial);
    add(start), add(++challenges_);
    for (const std::uint32_t word : random_words_of(board_)) add(word);
    add(tick);
    const auto digest = hash.finish();
    for (std::size_t i = 0; i < nonce_.size(); ++i) nonce_[i] = digest[i];
    has_nonce_ = true;
    out.nonce = nonce_;
    return protocol::Code::done;
  }
  protocol::Code take(const protocol::PairingPart& part) {
    for (std::size_t i = 0; i < part.bytes.size(); ++i) {
      if (part.part == 0) key_[i] = part.bytes[i];
      if (part.part > 0) signature_[(part.part - 1) * part.bytes.size() + i] = part.bytes[i];
    }
    return protocol::Code::done;
  }
  // Takes as long as a verification; the tick goes on.
  [[gnu::cold]] protocol::Code take(const protocol::PairingAnswer& answer, std::uint32_t tick) {
    using protocol::Code;
    if (wait_ticks_ > 0) return Code::wait;
    if (answer.action == protocol::PairingAction::open) {
      if (!memory_.is_paired()) return Code::not_paired;
      if (key_ != memory_.key()) return Code::other_key;
    } else if (state() == protocol::PairingState::locked) {
      return Code::locked;
    }
    // A host that lost the answer asks again.
    if (!has_nonce_) return is_open_ && key_ == memory_.key() ? Code::done : Code::wrong_signature;
    // A challenge is for one answer, right or wrong.
    has_nonce_ = false;
    if (!is_signed(answer.action)) return note_wrong(tick);
    wrong_ = 0;
    if (answer.action == protocol::PairingAction::pair)
      if (const Code code = code_of(memory_.pair(key_)); code != Code::done) return code;
    is_open_ = true;
    opened_at_ = tick;
    return Code::done;
  }
  // Ends the pairing: the service asks admits() first.
  protocol::Code remove() {
    if (!memory_.is_paired()) return protocol::Code::not_paired;
    return code_of(memory_.remove());
  }
  // The link was lost, another host is there, or it asked for it.
  void close() {
    is_open_ = false;
    has_nonce_ = false;
  }
  // Call repeatedly.
  void watch(std::uint32_t tick) {
    if (is_open_ && tick - opened_at_ >= kOpenS * tick_hz()) close();
    if (wait_ticks_ == 0) return;
    waited_ = tick - wrong_at_;
    if (waited_ >= wait_ticks_) wait_ticks_ = 0;
  }

 private:
  std::uint32_t tick_hz() const { return tick_hz_of(board_); }
  [[gnu::noinline]] bool is_signed(protocol::PairingAction action) const {
    const auto message = protocol::pairing_message(action, drive_, nonce_, key_);
    return ed25519::verify(key_, signature_, message.bytes);
  }
  protocol::Code note_wrong(std::uint32_t tick) {
    const std::uint32_t seconds = wrong_ < 6 ? kFirstWaitS << wrong_ : kMostWaitS;
    if (wrong_ < 6) ++wrong_;
    wrong_at_ = tick;
    waited_ = 0;
    wait_ticks_ = seconds * tick_hz();
    return protocol::Code::wrong_signature;
  }
  static protocol::Code code_of(storage::PairingError error) {
    if (error == storage::PairingError::none) return protocol::Code::done;
    return error == storage::PairingError::full ? protocol::Code::pairing_full : protocol::Code::flash;
  }

  Memory& memory_;
  B& board_;
  protocol::DriveName drive_{};
  protocol::Nonce nonce_{};
  ed25519::PublicKey key_{};  // of the answer that is being received
  ed25519::Signature signature_{};
  std::uint32_t challenges_ = 0;  // since the start
  std::uint32_t opened_at_ = 0;   // ticks; or the last request that wrote
  std::uint32_t wrong_at_ = 0;
  std::uint32_t waited_ = 0;
  std::uint32_t wait_ticks_ = 0;  // zero: no need to wait
  unsigned wrong_ = 0;            // signatures, one after the other
  bool has_nonce_ = false;
  bool is_open_ = false;
};

}  // namespace flexspline::firmware
