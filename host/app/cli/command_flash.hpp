// What puts a model, a parameter block or firmware on a drive, for flash and for the demo.
#pragma once

#include <filesystem>
#include <string>

#include "host/app/cli/inputs.hpp"

namespace flexspline::cli {

struct FlashOptions {
  std::string drive;
  std::filesystem::path model;
  std::filesystem::path block;
  std::filesystem::path settings;  // empty: those of the active block
  std::filesystem::path firmware;
  std::filesystem::path pairing_key;  // empty: none
  bool older = false;                 // firmware
  int draws = 4;                      // of the prediction; zero: none
  bool measured = false;              // as pack --measured
  bool yes = false;
  std::string json;
};
int flash(const FlashOptions& options, Console& console);
// flash --firmware.
int flash_firmware(const FlashOptions& options, Console& console);

}  // namespace flexspline::cli
