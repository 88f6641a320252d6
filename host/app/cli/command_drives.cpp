#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;

struct DrivesOptions {
  std::vector<std::string> also;  // ports and sockets to search
  std::string json;
};

struct FoundDrive {
  transport::Found found;
  json answer;  // null if it was not queried
};

json key_text(protocol::FirmwareKey key) {
  switch (key) {
    case protocol::FirmwareKey::none:
      return "none";
    case protocol::FirmwareKey::development:
      return "development";
    case protocol::FirmwareKey::own:
      return "own";
    default:
      return nullptr;
  }
}

// Of the present fault, or of the last one where the drive works again; null without one.
json reason_of(const protocol::Status& status) {
  return status.fault == 0 ? json() : json(protocol::fault_text(status.fault, status.fault_limit).reason);
}

// Queries the identity of a drive. A problem of one drive does not hide the others.
FoundDrive queried(transport::Found found) {
  FoundDrive seen{std::move(found), nullptr};
  if (!seen.found.usable) return seen;
  try {
    drive::Session session = open_drive(seen.found.drive);
    const protocol::Identity& id = session.identity();
    const protocol::Status status = session.status();
    const protocol::Pairing pairing = drive::pairing_of(session);
    const bool is_paired =
        pairing.state == protocol::PairingState::locked || pairing.state == protocol::PairingState::open;
    seen.answer = {{"serial", session.serial()},
                   {"board", session.board()},
                   {"firmware", fmt::format("{}.{}", id.firmware[0], id.firmware[1])},
                   {"protocol", fmt::format("{}.{}", id.major, id.minor)},
                   {"tick_hz", id.tick_hz},
                   {"firmware_key", key_text(id.firmware_key)},
                   {"pairing", protocol::name_of(pairing.state)},
                   {"pairing_key", is_paired ? json(drive::fingerprint(pairing.key)) : json()},
                   {"effects", id.effects},
                   {"block_bytes", id.block_bytes},
                   {"mode", protocol::name_of(status.mode)},
                   {"fault", protocol::fault_text(status.fault).name},
                   {"fault_reason", reason_of(status)},
                   {"has_parameters", status.has_parameters}};
  } catch (const std::exception& error) {
    seen.found.usable = false;
    seen.found.problem = error.what();
  }
  return seen;
}

int run(const DrivesOptions& options, Console& console) {
  std::vector<FoundDrive> all;
  for (transport::Found& found : transport::find_drives()) all.push_back(queried(std::move(found)));
  for (const std::string& name : options.also) all.push_back(queried({name, name, true, {}}));
  json list = json::array();
  for (const FoundDrive& one : all) {
    json entry = one.answer.is_null() ? json::object() : one.answer;
    entry["drive"] = one.found.drive;
    entry["usable"] = one.found.usable;
    entry["problem"] = one.found.problem.empty() ? json() : json(one.found.problem);
    if (one.answer.is_null()) {
      console.line(fmt::format("{:<28} {}", one.found.drive, console.bad(one.found.problem)));
    } else {
      console.line(fmt::format("{:<28} {} (board {}, firmware {}), {} effects, {}{}{}{}", one.found.drive,
                               one.answer["serial"].get<std::string>(), one.answer["board"].get<std::string>(),
                               one.answer["firmware"].get<std::string>(), one.answer["effects"].get<int>(),
                               one.answer["mode"].get<std::string>(),
                               one.answer["has_parameters"].get<bool>() ? "" : ", without parameters",
                               one.answer["firmware_key"] == "development" ? ", takes the public development key" : "",
                               one.answer["pairing_key"].is_null()
                                   ? ""
                                   : fmt::format(", {} by the pairing key {}", one.answer["pairing"].get<std::string>(),
                                                 one.answer["pairing_key"].get<std::string>())));
      if (one.answer["mode"] == "fault")
        console.line(output::wrapped(console.bad(one.answer["fault_reason"].get<std::string>()), 4));
    }
    list.push_back(std::move(entry));
  }
  if (all.empty())
    console.line(
        "no drive on USB; check cable and power. A drive on a serial line is named by its port (--drive "
        "serial:/dev/ttyACM0), and without hardware there is --drive twin.");
  output::save_json(options.json, {{"format", "flexspline-drives/1"}, {"drives", std::move(list)}});
  return kDone;
}

void declare(Parser& parser, DrivesOptions& options) {
  parser.option("--also", options.also, "search here, too: serial:PORT, tcp:HOST:PORT/TOKEN; may be repeated")
      .value("DRIVE")
      .one_value_each_time();
}

}  // namespace

Command drives_command() {
  return command<DrivesOptions>(
      {"drives",
       "the drives that can be reached, and what each is",
       "Lists the drives on USB with serial number, firmware, effects of the image and state; one that cannot be "
       "opened with the reason and what to do. What is behind a serial port or a socket is found with --also.",
       {"flexspline drives --also twin"}},
      declare, run);
}

}  // namespace flexspline::cli
