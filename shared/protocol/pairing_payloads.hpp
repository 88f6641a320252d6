// Payloads of the messages of a pairing, and what is signed. Since minor version 5.
//
// A drive that is paired refuses what writes (access.hpp) until its host has answered a challenge: it sends a nonce,
// the host sends key and signature in three parts, the drive verifies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/protocol/message.hpp"

namespace flexspline::protocol {

// Not stated: by firmware before protocol 1.5. None: the board has no memory for a key.
enum class PairingState : std::uint8_t { not_stated, none, not_paired, locked, open };
inline constexpr std::uint32_t kPairingStates = 5;

inline constexpr std::size_t kNonceBytes = 32, kPairingKeyBytes = 32;
using Nonce = std::array<std::uint8_t, kNonceBytes>;
using PairingKey = std::array<std::uint8_t, kPairingKeyBytes>;

// Answer to `pairing`.
struct Pairing {
  PairingState state = PairingState::none;
  std::uint32_t wait_ms = 0;  // until the next challenge, after wrong signatures
  PairingKey key{};           // public; zeros without one
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(state, kPairingStates), c(wait_ms), c(key);
  }
  bool operator==(const Pairing&) const = default;
};
// Answer to `pairing_challenge`. It is valid for one answer, until the next challenge.
struct PairingChallenge {
  Nonce nonce{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(nonce);
  }
  bool operator==(const PairingChallenge&) const = default;
};
// Request of `pairing_part`: the key, and both halves of the signature.
struct PairingPart {
  static constexpr std::size_t kParts = 3;
  std::uint8_t part = 0;
  std::array<std::uint8_t, 32> bytes{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(part, kParts), c(bytes);
  }
  bool operator==(const PairingPart&) const = default;
};
// Request of `pairing_answer`: what the signature is for. `pair` makes the key of the answer that of the drive; one
// that is paired has to be open for it.
enum class PairingAction : std::uint8_t { open, pair };
inline constexpr std::uint32_t kPairingActions = 2;
struct PairingAnswer {
  PairingAction action = PairingAction::open;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(action, kPairingActions);
  }
  bool operator==(const PairingAnswer&) const = default;
};

inline constexpr std::string_view kPairingDomain = "flexspline pairing 1";
inline constexpr std::size_t kIdentityTextBytes = 16;
// Board and serial number, as `identify` states them.
struct DriveName {
  std::array<std::uint8_t, kIdentityTextBytes> board{};
  std::array<std::uint8_t, kIdentityTextBytes> serial{};
};

// What the host signs: domain, action, drive, nonce and key, each in its fixed place.
struct PairingMessage {
  static constexpr std::size_t kBytes =
      kPairingDomain.size() + 1 + 2 * kIdentityTextBytes + kNonceBytes + kPairingKeyBytes;
  std::array<std::uint8_t, kBytes> bytes{};
};
constexpr PairingMessage pairing_message(PairingAction action, const DriveName& drive, const Nonce& nonce,
                                         const PairingKey& key) {
  PairingMessage message;
  std::size_t at = 0;
  for (const char letter : kPairingDomain) message.bytes[at++] = static_cast<std::uint8_t>(letter);
  message.bytes[at++] = static_cast<std::uint8_t>(action);
  const auto put = [&](std::span<const std::uint8_t> part) {
    for (const std::uint8_t byte : part) message.bytes[at++] = byte;
  };
  put(drive.board), put(drive.serial), put(nonce), put(key);
  return message;
}

}  // namespace flexspline::protocol
