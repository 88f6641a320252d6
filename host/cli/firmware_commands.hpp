// Commands for firmware images.
#pragma once

#include <filesystem>
#include <string>

#include "host/cli/drive_commands.hpp"
#include "host/cli/inputs.hpp"

namespace flexspline::cli {

struct ImageOptions {
  std::filesystem::path program;
  std::string board;
  std::string version;
  std::filesystem::path out;
  bool with_suffix = false;
  std::string json;
};
int run(const ImageOptions& options, Console& console);

// flash --firmware.
int flash_firmware(const FlashOptions& options, Console& console);

}  // namespace flexspline::cli
