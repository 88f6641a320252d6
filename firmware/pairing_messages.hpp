// The requests of a pairing: when the lock (parameter_lock.hpp) may serve them.
#pragma once

#include "firmware/messages.hpp"
#include "shared/protocol/pairing_payloads.hpp"

namespace flexspline::firmware {

struct PairingMessages {
  // Serves a request of the kinds `pairing` to `pairing_lock`; `answer` gets the payload, where there is one. A
  // signature takes background work as long as several hundred ticks, and a challenge or a new key is written into
  // flash memory: not while the drive is armed or its shaft turns.
  template <class Application, class Lock>
  static protocol::Code serve(const Application& application, Lock& lock, const protocol::Message& m,
                              protocol::Message& answer) {
    using protocol::Code, protocol::Kind;
    const Status status = application.snapshot();
    if (m.request() == Kind::pairing_part) {
      protocol::PairingPart part;
      const Code code = protocol::take_payload(m.content(), part);
      return code == Code::done ? lock.take(part) : code;
    }
    if (m.request() != Kind::pairing_answer && m.length != 0) return Code::wrong_length;
    if (m.request() == Kind::pairing) {
      protocol::put_payload(answer, lock.info());
      return Code::done;
    }
    if (m.request() == Kind::pairing_lock) {
      lock.close();
      return Code::done;
    }
    if (is_live(status.mode)) return Code::armed;
    if (!application.at_rest()) return Code::moving;
    if (m.request() == Kind::pairing_remove) return lock.remove();
    if (m.request() == Kind::pairing_challenge) {
      protocol::PairingChallenge challenge;
      const Code code = lock.challenge(status.tick, challenge);
      if (code == Code::done) protocol::put_payload(answer, challenge);
      return code;
    }
    protocol::PairingAnswer request;
    const Code code = protocol::take_payload(m.content(), request);
    return code == Code::done ? lock.take(request, status.tick) : code;
  }
};

}  // namespace flexspline::firmware
