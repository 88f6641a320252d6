#include "host/drive_link/drive/pairing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

#include "host/drive_link/deployment/sha256.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::drive {
namespace {

using protocol::Code;
using protocol::Kind;
using protocol::PairingAction;
using protocol::PairingState;

constexpr Milliseconds kLongestWait{3000};

void answer_challenge(Session& session, const PairingSigner& signer, PairingAction action) {
  if (const Milliseconds wait(pairing_of(session).wait_ms); wait > kLongestWait) {
    session.fail(fmt::format("it waits after wrong signatures; try again in {} s", (wait.count() + 999) / 1000));
  } else {
    std::this_thread::sleep_for(wait);
  }
  protocol::PairingChallenge challenge;
  const auto answer = session.ask_at_rest(protocol::request(Kind::pairing_challenge, 0, protocol::Empty{}));
  if (protocol::take_payload(answer.content(), challenge) != Code::done)
    session.fail("its answer cannot be understood");
  const protocol::DriveName drive{session.identity().board, session.identity().serial};
  const auto message = protocol::pairing_message(action, drive, challenge.nonce, signer.public_key);
  const PairingSigner::Signature signature = signer.sign(message.bytes);
  protocol::PairingPart part{0, signer.public_key};
  session.ask(Kind::pairing_part, part);
  for (std::uint8_t half = 0; half < 2; ++half) {
    part.part = static_cast<std::uint8_t>(half + 1);
    std::copy_n(signature.begin() + 32 * half, 32, part.bytes.begin());
    session.ask(Kind::pairing_part, part);
  }
  session.ask_at_rest(protocol::request(Kind::pairing_answer, 0, protocol::PairingAnswer{action}));
}

}  // namespace

std::string fingerprint(const protocol::PairingKey& key) {
  return deployment::sha256(key).substr(0, 16);
}

protocol::Pairing pairing_of(Session& session) {
  if (session.identity().minor < protocol::kMinorOfPairing) return {.state = PairingState::not_stated};
  return session.ask<protocol::Pairing>(Kind::pairing);
}

void require_access(Session& session, const std::optional<PairingSigner>& signer) {
  const protocol::Pairing known = pairing_of(session);
  const bool is_paired = known.state == PairingState::locked || known.state == PairingState::open;
  if (!signer && !is_paired) return;
  if (!signer)
    session.fail(fmt::format("its parameters are locked by the pairing key {}; give that key's file with --pairing-key",
                             fingerprint(known.key)));
  if (!is_paired)
    session.fail(
        fmt::format("it is not paired, so {} opens nothing; leave --pairing-key out, or pair it first "
                    "(flexspline pair)",
                    signer->name));
  if (known.key != signer->public_key)
    session.fail(fmt::format("it is paired with the key {}, and {} has the key {}; give the file of the first",
                             fingerprint(known.key), signer->name, fingerprint(signer->public_key)));
}

void pair(Session& session, const PairingSigner& signer) {
  const PairingState state = pairing_of(session).state;
  if (state == PairingState::not_stated)
    session.fail("its firmware is older than pairing; bring the firmware up to date");
  if (state == PairingState::none) session.fail("its board has no memory for a pairing key");
  answer_challenge(session, signer, PairingAction::pair);
}

void remove_pairing(Session& session) {
  session.ask_at_rest(protocol::request(Kind::pairing_remove, 0, protocol::Empty{}));
}

void lock(Session& session) noexcept {
  try {
    session.exchange(protocol::request(Kind::pairing_lock, 0, protocol::Empty{}));
  } catch (const std::exception&) {
    // A drive that lost its host locks by itself.
  }
}

Unlocked::Unlocked(Session& session, const std::optional<PairingSigner>& signer) {
  if (!signer) return;
  require_access(session, signer);
  answer_challenge(session, *signer, PairingAction::open);
  session_ = &session;
}

Unlocked::~Unlocked() {
  if (session_ != nullptr) lock(*session_);
}

}  // namespace flexspline::drive
