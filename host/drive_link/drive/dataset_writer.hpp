// Recordings as a data set that every command of the tool reads (host/input/data/RECORDINGS.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/drive_link/drive/recorder.hpp"

namespace flexspline::drive {

// Whose measurements they are.
struct Origin {
  std::string serial;
  std::string board;
  std::string firmware;
  std::string block_sha256;
};

// One CSV file of a run.
std::string csv_of(const Recording& recording, const Scales& scales, const Origin& origin);
// Writes the recordings that are complete, and a dataset.toml in the same folder.
std::string dataset_toml_of(const std::vector<Recording>& recordings, const Scales& scales, const Origin& origin);

}  // namespace flexspline::drive
