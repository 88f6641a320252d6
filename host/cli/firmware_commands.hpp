// Commands for firmware images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
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
  std::filesystem::path key;  // empty: the development key
  bool is_unsigned = false;
  std::uint16_t counter = 0;
  std::string json;
};
int run(const ImageOptions& options, Console& console);

struct SignOptions {
  std::filesystem::path image;
  std::filesystem::path key;
  std::filesystem::path out;
  std::optional<std::uint16_t> counter;  // none: the one that the image has
  bool with_suffix = false;
  std::string json;
};
int run(const SignOptions& options, Console& console);

struct KeyOptions {
  std::filesystem::path make;
  std::filesystem::path show;
  std::string json;
};
int run(const KeyOptions& options, Console& console);

// flash --firmware.
int flash_firmware(const FlashOptions& options, Console& console);

}  // namespace flexspline::cli
