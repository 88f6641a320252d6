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

// What of a recording the drive measured, by its active block: the rest of its telemetry is estimated by its model, or
// constant. And what it knows of its shafts' positions: else a position counts from where the shaft was.
struct Measures {
  bool output = true;
  bool torque = true;
  bool knows_turn = true;
  bool knows_output = true;
};
Measures measures_of(const Bytes& block);

// One CSV file of a run.
std::string csv_of(const Recording& recording, const Scales& scales, const Origin& origin,
                   const Measures& measures = {});
// The text of a dataset.toml that lists the recordings that are complete.
std::string dataset_toml_of(const std::vector<Recording>& recordings, const Scales& scales, const Origin& origin);

}  // namespace flexspline::drive
