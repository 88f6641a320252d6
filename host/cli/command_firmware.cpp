// Firmware images: image makes one, key and sign are for signatures, flash --firmware puts one on a drive.
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/firmware_commands.hpp"
#include "host/firmware/image_file.hpp"
#include "host/firmware/signing.hpp"
#include "host/firmware/update.hpp"
#include "host/model/model.hpp"
#include "host/output/json.hpp"

namespace flexspline::cli {

using nlohmann::json;
namespace files = firmware_files;

namespace {

std::string described(const std::optional<files::KeyPair>& key, std::uint16_t counter) {
  if (!key) return "not signed";
  return fmt::format("signed with {}, security counter {}",
                     key->is_development_key() ? "the development key, which is public"
                                               : "key " + files::text_of(key->public_key()).substr(0, 16) + "...",
                     counter);
}
// Writes the image and says what it is. `key`: the one that it is signed with.
void save_image(const char* format, const std::filesystem::path& out, files::Bytes bytes, bool with_suffix,
                const std::optional<files::KeyPair>& key, const std::string& json_file, Console& console) {
  const files::Image image = files::parse_image(bytes, out.string());
  if (with_suffix) bytes = files::with_dfu_suffix(std::move(bytes));
  model::save(out, std::string(bytes.begin(), bytes.end()));
  const std::uint16_t counter = image.header.security_counter;
  console.line(fmt::format("{}: firmware {} for board {}, {} bytes{}, {}", out.string(),
                           files::text_of(image.header.version), image.board(), image.bytes.size(),
                           with_suffix ? " and the suffix for dfu-util" : "", described(key, counter)));
  output::save_json(json_file, {{"format", format},
                                {"board", image.board()},
                                {"version", files::text_of(image.header.version)},
                                {"bytes", image.bytes.size()},
                                {"key", key ? json(files::text_of(key->public_key())) : json()},
                                {"development_key", key && key->is_development_key()},
                                {"security_counter", counter}});
}

}  // namespace

int run(const ImageOptions& options, Console& console) {
  if (options.is_unsigned && (!options.key.empty() || options.counter != 0))
    throw UsageError("--unsigned leaves the signature to flexspline sign, and with it --key and --counter");
  std::ifstream in(options.program, std::ios::binary);
  if (!in || std::filesystem::is_directory(options.program))
    throw UsageError(fmt::format("{} cannot be read; is the path right?", options.program.string()));
  const files::Bytes program{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const boot::Version version = files::version_of(options.version);
  files::Bytes image;
  try {
    image = files::make_image(program, options.board, version);
  } catch (const files::ImageError& error) {
    throw UsageError(fmt::format("{}: {}", options.program.string(), error.what()));
  }
  std::optional<files::KeyPair> key;
  if (!options.is_unsigned) {
    key.emplace(options.key.empty() ? files::development_key_pair() : files::load_key_pair(options.key));
    key->sign(image, options.counter);
  }
  save_image("flexspline-image/1", options.out, std::move(image), options.with_suffix, key, options.json, console);
  return kDone;
}

int run(const SignOptions& options, Console& console) {
  files::Image image = files::load_image(options.image);
  const std::optional<files::KeyPair> key(files::load_key_pair(options.key));
  key->sign(image.bytes, options.counter.value_or(image.header.security_counter));
  save_image("flexspline-sign/1", options.out, std::move(image.bytes), options.with_suffix, key, options.json, console);
  return kDone;
}

int run(const KeyOptions& options, Console& console) {
  if (options.make.empty() == options.show.empty())
    throw UsageError("choose one: --new KEY makes a pair of keys, --show KEY prints the public one of a file");
  const bool is_new = !options.make.empty();
  const files::KeyPair key = is_new ? files::new_key_pair() : files::load_key_pair(options.show);
  if (is_new) key.save(options.make);
  const std::string text = files::text_of(key.public_key());
  if (is_new) {
    console.line(fmt::format("{}: a new pair of keys. Keep the file secret, and a copy of it.", options.make.string()));
    console.line(fmt::format("  public key  {}", text));
  } else {
    console.line(text);
  }
  output::save_json(options.json, {{"format", "flexspline-key/1"}, {"key", text}, {"made", is_new}});
  return kDone;
}

int flash_firmware(const FlashOptions& options, Console& console) {
  if (!options.model.empty() || !options.block.empty() || !options.settings.empty())
    throw UsageError("--firmware goes alone; flash the model or block with a second command");
  const files::Image image = files::load_image(options.firmware);
  const files::Target target = files::find_target(options.drive);
  const std::string before = target.version ? files::text_of(*target.version) : "unknown";
  const std::string wanted = files::text_of(image.header.version);
  console.line(
      fmt::format("drive {} ({}){}", target.serial, target.board, target.is_loader ? ", in its boot loader" : ""));
  console.line(fmt::format("  firmware  {}", before));
  console.line(fmt::format("  new       {}, {} bytes", wanted, image.bytes.size()));
  files::require_fit(image, target, options.older);
  const bool flashes = confirmed("Flash it?", options.yes);
  std::string after = before;
  if (flashes)
    after = files::text_of(files::update(image, target, [&](const std::string& what) { console.progress(what); }));
  const bool runs = flashes && after == wanted;
  if (!flashes) console.line("Nothing was changed.");
  if (runs) console.line(fmt::format("{} {} runs.", console.good("Firmware"), after));
  output::save_json(options.json, {{"format", "flexspline-firmware/1"},
                                   {"drive", {{"serial", target.serial}, {"board", target.board}}},
                                   {"before", target.version ? json(before) : json()},
                                   {"image", wanted},
                                   {"after", target.version || flashes ? json(after) : json()},
                                   {"flashed", runs}});
  if (runs || !flashes) return kDone;
  console.error(
      fmt::format("drive {}: firmware {} failed its trial and was rolled back; {} runs. The drive can be used; correct "
                  "the image and flash it again",
                  target.serial, wanted, after));
  return kNotMet;
}

}  // namespace flexspline::cli
