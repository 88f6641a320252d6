// The pairing key of a drive (firmware/parameter_lock.hpp): answers its challenges, pairs it and ends the pairing.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "host/drive_link/drive/session.hpp"
#include "shared/protocol/pairing_payloads.hpp"

namespace flexspline::drive {

// A key that signs. It does not leave the host.
struct PairingSigner {
  using Signature = std::array<std::uint8_t, 64>;
  std::string name;  // of its file, for messages
  protocol::PairingKey public_key{};
  std::function<Signature(std::span<const std::uint8_t>)> sign;
};

// The first sixteen digits of the key's SHA-256.
std::string fingerprint(const protocol::PairingKey& key);

// State `not_stated` where the firmware is older than pairing.
protocol::Pairing pairing_of(Session& session);
// Whether this host can write: throws DriveError where the drive is locked and there is no signer, it is paired with
// another key, or it is not paired and there is a signer.
void require_access(Session& session, const std::optional<PairingSigner>& signer);
// Makes the key that of the drive. A drive that is paired has to be open. It is open afterwards.
void pair(Session& session, const PairingSigner& signer);
// Ends the pairing. The drive has to be open.
void remove_pairing(Session& session);
// The next write needs another challenge. Never throws.
void lock(Session& session) noexcept;

// The drive is open while one of these exists; without a signer it does nothing.
class Unlocked {
 public:
  Unlocked(Session& session, const std::optional<PairingSigner>& signer);
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  Session* session_ = nullptr;  // none: there is nothing to lock
};

}  // namespace flexspline::drive
