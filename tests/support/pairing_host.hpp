// A host's side of a pairing, by libsodium, and a lock without a drive behind it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "firmware/parameter_lock.hpp"
#include "shared/protocol/payloads.hpp"
#include "tests/support/flash_model.hpp"
#include "tests/support/signing_key.hpp"

namespace flexspline::tests {

struct PairingAnswerOf {
  protocol::PairingKey key{};
  ed25519::Signature signature{};
  std::array<protocol::PairingPart, 3> parts() const {
    std::array<protocol::PairingPart, 3> all{};
    for (std::uint8_t i = 0; i < 3; ++i) {
      all[i].part = i;
      const std::uint8_t* from = i == 0 ? key.data() : signature.data() + 32 * (i - 1);
      std::copy_n(from, 32, all[i].bytes.begin());
    }
    return all;
  }
};
inline PairingAnswerOf answer_of(const SigningKey& key, protocol::PairingAction action,
                                 const protocol::DriveName& drive, const protocol::Nonce& nonce) {
  return {key.public_key, key.sign(protocol::pairing_message(action, drive, nonce, key.public_key).bytes)};
}

// A board without a source of random numbers: what is left is the memory's number.
struct StillBoard {
  static constexpr std::uint32_t kTickHz = 20'000;
  static constexpr std::uint32_t kTelemetryWords = 64;
  const firmware::Readings& read() const { return readings; }
  void actuate(const firmware::Actuation&) {}
  bool tick_overrun() const { return false; }
  void feed_watchdog() {}
  firmware::ResetCause reset_cause() const { return firmware::ResetCause::power; }
  firmware::Readings readings{};
};

inline constexpr std::size_t kPairingSector = 16'384;
using PairingCells = tests::FlashCells<kPairingSector, 1>;
using PairingFlash = tests::FlashModel<kPairingSector, 1>;
using PairingStore = storage::PairingMemory<PairingFlash>;

// A lock from one start to the next.
struct LockBench {
  explicit LockBench(PairingCells& cells, const protocol::DriveName& name = {{'b'}, {'s', '1'}}, std::uint64_t seed = 1)
      : flash(cells, seed), drive(name) {
    lock.start(drive);
  }
  protocol::Nonce challenge() {
    protocol::PairingChallenge c;
    EXPECT_EQ(lock.challenge(tick, c), protocol::Code::done);
    return c.nonce;
  }
  protocol::Code give(const PairingAnswerOf& answer, protocol::PairingAction action) {
    for (const protocol::PairingPart& part : answer.parts()) EXPECT_EQ(lock.take(part), protocol::Code::done);
    return lock.take(protocol::PairingAnswer{action}, tick);
  }
  protocol::Code answer(const SigningKey& key, protocol::PairingAction action) {
    return give(answer_of(key, action, drive, challenge()), action);
  }
  void pass(double seconds) {
    tick += static_cast<std::uint32_t>(seconds * StillBoard::kTickHz);
    lock.watch(tick);
  }
  bool writes() { return lock.admits(protocol::request(protocol::Kind::block_erase_all, 0, protocol::Empty{}), tick); }

  PairingFlash flash;
  PairingStore memory{flash};
  StillBoard board;
  firmware::ParameterLock<PairingStore, StillBoard> lock{memory, board};
  protocol::DriveName drive;
  std::uint32_t tick = 1000;
};

}  // namespace flexspline::tests
