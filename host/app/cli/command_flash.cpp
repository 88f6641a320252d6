// What is kept on a drive: flash, backup, restore.
#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/command_flash.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/app/cli/flash_prediction.hpp"
#include "host/drive_link/drive/block_changes.hpp"
#include "host/drive_link/drive/model_block.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "host/drive_link/drive/stored_zero.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::cli {
namespace {

using drive::BlockChange;
using drive::BlockView;
using drive::Bytes;
using nlohmann::json;

struct BackupOptions {
  std::string drive;
  std::filesystem::path out;
  bool previous = false;
  std::string json;
};

struct RestoreOptions {
  std::string drive;
  bool factory_reset = false;
  std::filesystem::path pairing_key;  // empty: none
  bool yes = false;
  std::string json;
};

json json_of(const drive::Session& session) {
  return {{"serial", session.serial()}, {"board", session.board()}, {"drive", session.name()}};
}
json json_of(const BlockView& view) {
  if (view.bytes == 0) return nullptr;
  return {{"bytes", view.bytes}, {"sha256", view.sha256}, {"model", view.model}, {"drive", view.drive}};
}
json json_of(const std::vector<BlockChange>& changes) {
  json list = json::array();
  for (const BlockChange& c : changes)
    list.push_back({{"effect", c.effect},
                    {"change", c.what},
                    {"parameter", c.parameter.empty() ? json() : json(c.parameter)},
                    {"before", output::json_number(c.before)},
                    {"after", output::json_number(c.after)},
                    {"unit", c.unit.empty() ? json() : json(c.unit)}});
  return list;
}

std::string described(const BlockView& view) {
  if (view.bytes == 0) return "none";
  return fmt::format("\"{}\", {} bytes, SHA-256 {}...", view.model, view.bytes, view.sha256.substr(0, 16));
}

void print(const std::vector<BlockChange>& changes, Console& console) {
  std::vector<std::string> same;
  for (const BlockChange& c : changes) {
    if (c.what == "same") {
      same.push_back(c.effect);
    } else if (c.parameter.empty()) {
      console.line(fmt::format("  {:<9} {}", c.what, c.effect));
    } else {
      const std::string percent =
          c.before && *c.before != 0.0 ? fmt::format("  ({:+.3g} %)", 100.0 * (*c.after / *c.before - 1.0)) : "";
      console.line(fmt::format("  {:<9} {:<40} {:>12} -> {:<12} {}{}", c.what, c.effect + "." + c.parameter,
                               c.before ? output::number(*c.before, 5) : "-", output::number(*c.after, 5), c.unit,
                               percent));
    }
  }
  if (!same.empty()) console.line(fmt::format("  {:<9} {}", "same", fmt::format("{}", fmt::join(same, ", "))));
}

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw UsageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// The name is a label that pack --drive-name gave: serial numbers and boards can be compared, other names cannot.
void warn_of_other_drive(const std::string& label, const drive::Session& session, Console& console) {
  if (label.empty() || label == session.serial() || label == session.board()) return;
  console.warn(
      fmt::format("the block was packed for drive \"{}\", and this is {}; flash it only if that is the same one", label,
                  named(session)));
}

struct NewBlock {
  Bytes bytes;
  std::optional<model::ModelFile> model;  // none: of --block
};
NewBlock block_of(const FlashOptions& options, drive::Session& session, const Bytes& active, Console& console) {
  if (!options.block.empty()) {
    const Bytes block = read_block_file(options.block);
    warn_of_other_drive(drive::view_of(block).drive, session, console);
    return {drive::keeping_motor(drive::keeping_stored_zero(block, active), active), {}};
  }
  model::ModelFile file = load_model(options.model);
  std::optional<drive::SettingsFile> settings;
  if (!options.settings.empty()) settings = {text_of_file(options.settings), options.settings.string()};
  console.progress("proving the block and comparing it with double");
  drive::ModelBlock made = drive::model_block(session, active, file.model, settings, options.measured);
  for (const std::string& warning : made.warnings) console.warn(warning);
  return {std::move(made.bytes), std::move(file)};
}

int run(const BackupOptions& options, Console& console) {
  drive::Session session = open_drive(options.drive);
  const auto which = options.previous ? protocol::Which::previous : protocol::Which::active;
  const Bytes block = session.read_block(which);
  if (block.empty())
    session.fail(options.previous ? "it has no block before the active one" : "it has no parameter block to back up");
  model::save(options.out, std::string(block.begin(), block.end()));
  const BlockView view = drive::view_of(block);
  console.line(fmt::format("{}: block {} of {}", options.out.string(), described(view), named(session)));
  output::save_json(options.json,
                    {{"format", "flexspline-backup/1"}, {"drive", json_of(session)}, {"block", json_of(view)}});
  return kDone;
}

int factory_reset(const RestoreOptions& options, drive::Session& session,
                  const std::optional<drive::PairingSigner>& signer, Console& console) {
  const BlockView before = drive::view_of(session.read_block(protocol::Which::active));
  console.line(named(session));
  console.line(fmt::format("  active    {}", described(before)));
  const bool erases = confirmed("Erase it and the one before? A backup is all that is left then.", options.yes);
  if (erases) {
    const drive::Unlocked unlocked(session, signer);
    session.erase_all_blocks();
  }
  console.line(erases ? "Both blocks are erased; the block in use stays active until the drive restarts."
                      : "Nothing was changed.");
  output::save_json(options.json, {{"format", "flexspline-restore/1"},
                                   {"drive", json_of(session)},
                                   {"before", json_of(before)},
                                   {"after", nullptr},
                                   {"changes", json::array()},
                                   {"restored", false},
                                   {"erased", erases}});
  return kDone;
}

int run(const RestoreOptions& options, Console& console) {
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  drive::require_access(session, signer);
  if (options.factory_reset) return factory_reset(options, session, signer, console);
  const Bytes active = session.read_block(protocol::Which::active);
  const Bytes previous = session.read_block(protocol::Which::previous);
  if (previous.empty()) session.fail(std::string(protocol::text_of(protocol::Code::no_previous)));
  const std::vector<BlockChange> changes = drive::changes(active, previous);
  const BlockView before = drive::view_of(active), after = drive::view_of(previous);
  console.line(named(session));
  console.line(fmt::format("  active    {}", described(before)));
  console.line(fmt::format("  before it {}", described(after)));
  print(changes, console);
  if (drive::motor_of(active).pole_pairs > 0 && drive::motor_of(previous).pole_pairs == 0)
    console.warn("the block before has no motor of flexspline commission; run that again after it");
  const bool restores = confirmed("Restore it?", options.yes);
  if (restores) {
    const drive::Unlocked unlocked(session, signer);
    session.restore();
  }
  console.line(restores ? "Restored and in use; another restore returns to the block that was active before."
                        : "Nothing was changed.");
  output::save_json(options.json, {{"format", "flexspline-restore/1"},
                                   {"drive", json_of(session)},
                                   {"before", json_of(before)},
                                   {"after", json_of(after)},
                                   {"changes", json_of(changes)},
                                   {"restored", restores}});
  return kDone;
}

void declare(Parser& parser, FlashOptions& options) {
  take_drive(parser, options.drive);
  parser.option("--model", options.model, "model file, packed for this drive").value("MODEL");
  Option block = parser.option("--block", options.block, "parameter block of pack or backup");
  block.value("BLOCK");
  parser
      .option("--settings", options.settings,
              "with --model: of the drive, as pack --drive takes them (default: those of its active block)")
      .value("FILE.toml")
      .excludes(block);
  Option firmware = parser.option("--firmware", options.firmware, "firmware image of flexspline image, over USB");
  firmware.value("IMAGE");
  parser.flag("--older", options.older, "with --firmware: an image older than what the drive has");
  parser
      .option("--draws", options.draws,
              "with --model: random parameter sets drawn for the predicted error; 0: no prediction")
      .one_of_numbers({0, 3, 4, 5, 6, 8, 12, 20})
      .shows_default()
      .excludes(block)
      .excludes(firmware);
  parser.flag("--measured", options.measured, "with --model: as in pack --measured").excludes(block).excludes(firmware);
  take_pairing_key(parser, options.pairing_key);
  take_yes(parser, options.yes);
}

void declare(Parser& parser, BackupOptions& options) {
  take_drive(parser, options.drive);
  parser.option("--out", options.out, "file for the block").required().value("BLOCK");
  parser.flag("--previous", options.previous, "the block before the active one");
}

void declare(Parser& parser, RestoreOptions& options) {
  take_drive(parser, options.drive);
  parser.flag("--factory-reset", options.factory_reset,
              "erase both blocks permanently: after a restart the drive is as delivered by its manufacturer");
  take_pairing_key(parser, options.pairing_key);
  take_yes(parser, options.yes);
}

}  // namespace

int flash(const FlashOptions& options, Console& console) {
  if (!options.firmware.empty()) return flash_firmware(options, console);
  if (options.older) throw UsageError("--older is for --firmware; backup and restore go back to an older block");
  if (options.model.empty() == options.block.empty())
    throw UsageError(
        "choose what to flash: --model MODEL, --block BLOCK of flexspline pack or backup, or --firmware IMAGE");
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  drive::require_access(session, signer);
  const Bytes active = session.read_block(protocol::Which::active);
  const NewBlock made = block_of(options, session, active, console);
  const Bytes& block = made.bytes;
  const std::vector<BlockChange> changes = drive::changes(active, block);
  const BlockView before = drive::view_of(active), after = drive::view_of(block);
  console.line(fmt::format("{}", named(session)));
  console.line(fmt::format("  active    {}", described(before)));
  console.line(fmt::format("  new       {}", described(after)));
  print(changes, console);
  const bool is_new = block != active;
  if (!is_new) console.line("The drive has this block already; nothing to do.");
  json predicted;
  if (is_new && made.model) predicted = predict_flash(made.model->model, block, active, options.draws, console);
  const bool flashes = is_new && confirmed("Flash it?", options.yes);
  if (is_new && !flashes) console.line("Nothing was changed.");
  if (flashes) {
    const drive::Unlocked unlocked(session, signer);
    session.write_block(block, [&](std::size_t sent) {
      console.progress(fmt::format("flashing: {} of {} bytes", sent, block.size()));
    });
    console.line(fmt::format("{} flashed, read back and in use; flexspline restore goes back to the one before.",
                             console.good("Block")));
  }
  output::save_json(options.json, {{"format", "flexspline-flash/1"},
                                   {"drive", json_of(session)},
                                   {"before", json_of(before)},
                                   {"after", json_of(after)},
                                   {"changes", json_of(changes)},
                                   {"predicted", predicted},
                                   {"flashed", flashes}});
  return kDone;
}

Command flash_command() {
  return command<FlashOptions>(
      {"flash",
       "puts a model, a parameter block or new firmware on a drive",
       "Packs the model for this drive (its tick rate, its effects), or takes a block as it is, and prints what that "
       "changes against the block in use, parameter by parameter. The drive keeps the old block until the new one "
       "has arrived completely and has passed its checks, and keeps it for restore; it refuses while it is armed. "
       "The gain of the model at slow reversals is predicted from its values and their uncertainty and printed "
       "first. On a terminal it asks first; without one, or with --yes, it does not. --firmware takes an image of "
       "flexspline image to a drive on USB: it goes to its boot loader, gets the image and tries it; an image that "
       "fails is rolled back (exit code 1). Images for other boards, damaged ones and, without --older, older ones "
       "are refused before anything is sent.",
       {kMakeData, kIdentify, "flexspline flash --drive twin --model fitted.toml --yes"}},
      declare, flash);
}

Command backup_command() {
  return command<BackupOptions>(
      {"backup",
       "saves the parameter block of a drive",
       "Reads the active block, or with --previous the one before it, into a file that flash --block and unpack "
       "take.",
       {"flexspline backup --drive twin --out drive.block"}},
      declare, run);
}

Command restore_command() {
  return command<RestoreOptions>(
      {"restore",
       "goes back to the parameter block before",
       "Makes the block before the active one active, and prints first what that changes. A second restore goes "
       "forward again. Nothing is erased; a power cut leaves one or the other. With --factory-reset both blocks are "
       "erased: the drive has no parameters from its next start on, until another block is flashed.",
       {kMakeData, kIdentify, "flexspline flash --drive twin --model fitted.toml --yes",
        "flexspline restore --drive twin --yes"}},
      declare, run);
}

}  // namespace flexspline::cli
