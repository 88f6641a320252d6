#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace flexspline::scenario {

/// The arguments of `flexspline-hil drive`.
struct DriveOptions {
  std::string scenario = "sine";  ///< a name or a file
  double seconds = 0.0;           ///< zero: that of the scenario
  std::string plant_file;
  std::vector<std::string> with;
  std::string hide;
  std::string compensation = "both";
  std::string inject;
  double inject_at_s = -1.0;
  std::string processor_image;
  std::string block_file;
  std::string motor = "current";  ///< what the amplifier takes: a current, or "three-phase"
  std::string trace_file;         ///< of one run
  std::string json;
  std::uint32_t tick_hz = 20'000;
  std::uint64_t seed = 1;
  std::optional<double> wake_turns;  ///< none: random, by the seed
};

/// Runs the scenario and prints the result. Throws std::exception with the reason where it cannot.
void run_drive(const DriveOptions& options);

/// The arguments of `flexspline-hil data-sheet`.
struct DataSheetOptions {
  std::string scenario;  ///< whose drive; empty: none
  std::string plant_file;
  std::vector<std::string> with;
  std::string hide;
  std::string out;
};

/// Writes the data sheet of a scenario's drive into a folder: settings.toml for `flexspline pack --drive`,
/// known-model.toml with its effects and their true values except the hidden one, and whole-model.toml with the hidden
/// one as well, if a model can have it. Throws std::exception with the reason where it cannot.
void write_data_sheet(const DataSheetOptions& options);

/// Prints the built-in scenarios.
void list_scenarios();

}  // namespace flexspline::scenario
