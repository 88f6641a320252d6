// Locks the parameters of a drive by a key: pair and unpair.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/output/answers/json.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using protocol::PairingState;

struct PairOptions {
  std::string drive;
  std::filesystem::path pairing_key;  // empty: only shows the state
  std::filesystem::path old_key;      // of a drive that is paired already
  bool lock = false;
  std::string json;
};

struct UnpairOptions {
  std::string drive;
  std::filesystem::path pairing_key;
  bool yes = false;
  std::string json;
};

std::string described(const protocol::Pairing& known) {
  switch (known.state) {
    case PairingState::not_stated:
      return "its firmware is older than pairing; its parameters are not locked";
    case PairingState::none:
      return "its board has no memory for a pairing key; its parameters are not locked";
    case PairingState::not_paired:
      return "not paired: every host can change its parameters";
    default:
      return fmt::format("paired with the key {}, {}", drive::fingerprint(known.key),
                         known.state == PairingState::locked ? "locked" : "open for a host");
  }
}
void report(const char* format, drive::Session& session, bool changed, const std::string& file, Console& console) {
  const protocol::Pairing known = drive::pairing_of(session);
  const bool is_paired = known.state == PairingState::locked || known.state == PairingState::open;
  console.line(fmt::format("  {}", described(known)));
  output::save_json(file, {{"format", format},
                           {"drive", {{"serial", session.serial()}, {"drive", session.name()}}},
                           {"pairing", protocol::name_of(known.state)},
                           {"key", is_paired ? json(drive::fingerprint(known.key)) : json()},
                           {"changed", changed}});
}

int run(const PairOptions& options, Console& console) {
  const auto signer = pairing_signer(options.pairing_key);
  const auto old = pairing_signer(options.old_key);
  drive::Session session = open_drive(options.drive);
  console.line(named(session));
  if (options.lock) drive::lock(session);
  bool changes = false;
  if (signer) {
    const protocol::Pairing known = drive::pairing_of(session);
    const bool is_paired = known.state == PairingState::locked || known.state == PairingState::open;
    changes = !is_paired || known.key != signer->public_key;
    if (changes && is_paired && !old)
      session.fail(
          fmt::format("it is paired with the key {} already; give that key's file with --old-key to exchange it",
                      drive::fingerprint(known.key)));
    if (changes && old) drive::require_access(session, old);
    if (changes) {
      const drive::Unlocked unlocked(session, old);
      drive::pair(session, *signer);
      drive::lock(session);
    } else {
      console.line("  The drive is paired with this key already; nothing to do.");
    }
  }
  report("flexspline-pair/1", session, changes, options.json, console);
  return kDone;
}

int run(const UnpairOptions& options, Console& console) {
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  console.line(named(session));
  drive::require_access(session, signer);
  const bool removes = confirmed("End the pairing? Every host can change its parameters then.", options.yes);
  if (removes) {
    const drive::Unlocked unlocked(session, signer);
    drive::remove_pairing(session);
  }
  report("flexspline-unpair/1", session, removes, options.json, console);
  return kDone;
}

void declare(Parser& parser, PairOptions& options) {
  take_drive(parser, options.drive);
  const Option key =
      parser
          .option("--pairing-key", options.pairing_key,
                  "lock the parameters by this key of flexspline key --new (default: only shows the state)")
          .value("KEY");
  parser.option("--old-key", options.old_key, "the key that the drive is paired with, to exchange it")
      .value("KEY")
      .needs(key);
  parser
      .flag("--lock", options.lock,
            "lock the parameters now; a drive that a host left unlocked locks itself after a minute")
      .excludes(key);
}

void declare(Parser& parser, UnpairOptions& options) {
  take_drive(parser, options.drive);
  parser.option("--pairing-key", options.pairing_key, "the key that the drive is paired with").required().value("KEY");
  take_yes(parser, options.yes);
}

}  // namespace

Command pair_command() {
  return command<PairOptions>(
      {"pair",
       "locks the parameters of a drive by a key",
       "The drive keeps the public key and refuses from then on whatever changes its parameters, its memory or its "
       "residual map, unless the host signs a challenge with the secret key: flash, restore, home --store and "
       "monitor --residual-map take it as --pairing-key. Telemetry, arming and set points stay free. Keep a copy of "
       "the file: without it the pairing ends only by firmware that was built for that, or with a programmer. Take "
       "another key than the one for firmware. Without --pairing-key the state is shown.",
       {"flexspline key --new pairing.key", "flexspline pair --drive twin --pairing-key pairing.key",
        "flexspline unpair --drive twin --pairing-key pairing.key", "flexspline pair --drive twin"}},
      declare, run);
}

Command unpair_command() {
  return command<UnpairOptions>(
      {"unpair",
       "ends the pairing of a drive with a key",
       "Every host can change the parameters of the drive again. It needs the key that the drive is paired with.",
       {"flexspline key --new pairing.key", "flexspline pair --drive twin --pairing-key pairing.key",
        "flexspline unpair --drive twin --pairing-key pairing.key"}},
      declare, run);
}

}  // namespace flexspline::cli
