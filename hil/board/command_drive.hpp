#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flexspline::board {

/// The arguments of `flexspline-hil drive`.
struct DriveOptions {
  std::string scenario = "sine";
  double seconds = 10.0;
  std::string plant_file;
  std::vector<std::string> with;
  std::string hide;
  std::string compensation = "both";
  std::string inject;
  double inject_at_s = -1.0;
  std::string processor_image;
  std::string block_file;
  std::string json;
  std::uint64_t seed = 1;
};

/// Runs the scenario and prints what happened. Throws std::exception with the reason where it cannot.
void run_drive(const DriveOptions& options);

}  // namespace flexspline::board
