// Firmware images: image makes one, flash --firmware puts one on a drive.
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/cli/firmware_commands.hpp"
#include "host/firmware/image_file.hpp"
#include "host/firmware/update.hpp"
#include "host/model/model.hpp"
#include "host/output/json.hpp"

namespace flexspline::cli {

using nlohmann::json;
namespace files = firmware_files;

int run(const ImageOptions& options, Console& console) {
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
  const std::size_t bytes = image.size();
  if (options.with_suffix) image = files::with_dfu_suffix(std::move(image));
  model::save(options.out, std::string(image.begin(), image.end()));
  console.line(fmt::format("{}: firmware {} for board {}, {} bytes{}", options.out.string(), files::text_of(version),
                           options.board, bytes, options.with_suffix ? " and the suffix for dfu-util" : ""));
  output::save_json(options.json, {{"format", "flexspline-image/1"},
                                   {"board", options.board},
                                   {"version", files::text_of(version)},
                                   {"bytes", bytes}});
  return kDone;
}

int flash_firmware(const FlashOptions& options, Console& console) {
  if (!options.model.empty() || !options.block.empty() || !options.settings.empty())
    throw UsageError("--firmware goes alone; flash the model or block with a second command");
  const files::Image image = files::load_image(options.firmware);
  const files::Target target = files::find_target(options.drive);
  const std::string before = target.version ? files::text_of(*target.version) : "none";
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
      fmt::format("drive {}: firmware {} did not do well and was taken back; {} runs. The drive can be used; mend the "
                  "image and flash it again",
                  target.serial, wanted, after));
  return kNotMet;
}

}  // namespace flexspline::cli
