// Firmware images: image makes one, key and sign are for signatures, flash --firmware puts one on a drive.
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/app/cli/command.hpp"
#include "host/app/cli/command_flash.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/drive_link/firmware/image_file.hpp"
#include "host/drive_link/firmware/signing.hpp"
#include "host/drive_link/firmware/update.hpp"
#include "host/output/answers/json.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
namespace files = firmware_files;

struct ImageOptions {
  std::filesystem::path program;
  std::string board;
  std::string version;
  std::filesystem::path out;
  bool with_suffix = false;
  std::filesystem::path key;  // empty: the development key
  bool is_unsigned = false;
  std::uint16_t counter = 0;
  std::string json;
};

struct SignOptions {
  std::filesystem::path image;
  std::filesystem::path key;
  std::filesystem::path out;
  std::optional<std::uint16_t> counter;  // none: the one that the image has
  bool with_suffix = false;
  std::string json;
};

struct KeyOptions {
  std::filesystem::path make;
  std::filesystem::path show;
  std::string json;
};

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

void declare(Parser& parser, ImageOptions& options) {
  parser.option("--program", options.program, "BIN file of a linker, linked to start behind a header of 512 bytes")
      .required()
      .value("BIN");
  parser.option("--board", options.board, "the board that it is for, as flexspline drives calls it")
      .required()
      .value("NAME");
  parser.option("--version", options.version, "major and minor, as 1.2").required().value("N.N");
  parser.option("--out", options.out, "file for the image").required().value("IMAGE");
  parser.flag("--dfu", options.with_suffix, "with the suffix that dfu-util looks for");
  parser.option("--key", options.key, "sign with this key of flexspline key (default: the public development key)")
      .value("KEY");
  parser.option("--counter", options.counter, "security counter: a drive takes no smaller one than it has run (0)")
      .value("N");
  parser.flag("--unsigned", options.is_unsigned, "without a signature; flexspline sign adds it later");
}

void declare(Parser& parser, SignOptions& options) {
  parser.option("--image", options.image, "firmware image of flexspline image").required().value("IMAGE");
  parser.option("--key", options.key, "file of flexspline key --new").required().value("KEY");
  parser.option("--out", options.out, "file for the signed image").required().value("IMAGE");
  parser.option("--counter", options.counter, "security counter (default: the one that the image has)").value("N");
  parser.flag("--dfu", options.with_suffix, "with the suffix that dfu-util looks for");
}

void declare(Parser& parser, KeyOptions& options) {
  parser.option("--new", options.make, "make a pair of keys and write it into this file").value("KEY");
  parser.option("--show", options.show, "print the public key of this file").value("KEY");
}

}  // namespace

int flash_firmware(const FlashOptions& options, Console& console) {
  if (!options.model.empty() || !options.block.empty() || !options.settings.empty())
    throw UsageError("--firmware goes alone; flash the model or block with a second command");
  if (!options.pairing_key.empty())
    throw UsageError("--pairing-key is for parameters; firmware is signed with the key of the boot loader");
  const files::Image image = files::load_image(options.firmware);
  const files::Target target = files::find_target(options.drive);
  const std::string before = target.version ? files::text_of(*target.version) : "unknown";
  const std::string wanted = files::text_of(image.header.version);
  console.line(
      fmt::format("drive {} ({}){}", target.serial, target.board, target.is_loader ? ", in its boot loader" : ""));
  console.line(fmt::format("  firmware  {}", before));
  console.line(fmt::format("  new       {}, {} bytes", wanted, image.bytes.size()));
  files::require_fit(image, target, options.older);
  if (!target.version && !options.older)
    console.warn(
        "the boot loader does not say which firmware is installed, so whether the image is older is not checked; an "
        "image with a smaller security counter is refused by the drive itself");
  const bool flashes = confirmed("Flash it?", options.yes);
  std::string after = before;
  if (flashes)
    after = files::text_of(files::update(image, target, [&](const std::string& what) { console.progress(what); }));
  const bool runs = flashes && after == wanted;
  if (!flashes) console.line("Nothing was changed.");
  if (runs) console.line(fmt::format("{} {} runs.", console.good("Firmware"), after));
  if (runs && before == wanted)
    console.warn(
        "the firmware before has the same version: if the image failed its trial and was rolled back, that cannot be "
        "seen; give each image a version of its own");
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

Command image_command() {
  return command<ImageOptions>(
      {"image",
       "makes a firmware image of a program",
       "Puts before a program (BIN file) the header that boot loader and flash --firmware check: length, checksum, "
       "board, version, security counter and signature. The program has to be linked to begin 512 bytes behind its "
       "slot. Without --key the image is signed with the development key, which is public: boot loaders that were "
       "built without a key of their own take it. --dfu adds the suffix that dfu-util looks for. flexspline-hil "
       "image makes images for the twin.",
       {"echo a program | tee program.bin",
        "flexspline image --program program.bin --board stm32f405-dac --version 1.2 --out firmware.image"}},
      declare, run);
}

Command sign_command() {
  return command<SignOptions>(
      {"sign",
       "signs a firmware image",
       "Signs an image (Ed25519) with the secret key of a file of flexspline key --new, for boot loaders that were "
       "built with its public key; a signature that the image has is replaced. --counter raises the security "
       "counter: once such an image was confirmed by a drive, the drive refuses all with a smaller one.",
       {"echo a program | tee program.bin",
        "flexspline image --program program.bin --board stm32f405-dac --version 1.2 --unsigned --out plain.image",
        "flexspline key --new product.key",
        "flexspline sign --image plain.image --key product.key --counter 1 --out firmware.image"}},
      declare, run);
}

Command key_command() {
  return command<KeyOptions>(
      {"key",
       "makes and shows keys that firmware is signed with, or drives are paired with",
       "--new makes a pair of Ed25519 keys and writes both into a file that its owner alone may read (mode 0600); "
       "an existing file is never overwritten. Keep a copy: a drive whose boot loader has this public key takes "
       "images signed by it and no others. --show prints the public key of a file, for the build of the boot "
       "loader; it prints nothing secret.",
       {"flexspline key --new product.key", "flexspline key --show product.key"}},
      declare, run);
}

}  // namespace flexspline::cli
