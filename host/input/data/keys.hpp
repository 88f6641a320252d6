// The keys of a measurement, from `# key: value` lines and from dataset.toml, in one form.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {

struct KeyValue {
  std::string text;
  std::optional<double> number;
  std::string file;
  std::size_t line = 0;
};
using KeyMap = std::map<std::string, KeyValue>;

// The most of anything that is counted in a motor: pole pairs, slots.
inline constexpr double kMostCounted = 1000.0;

// Keys of the drive as a whole: axis, gear_ratio, torque_constant_nm_a, pitch_m, pole_pairs, motor_slots.
bool is_drive_key(std::string_view key);
// Keys of one experiment: load, role, encoder_counts, noise_std_current_a, ...
bool is_experiment_key(std::string_view key);
// Known keys of both groups near to `key`, for messages; empty if none is.
std::string nearest_key(std::string_view key);

// Keys of the header lines. Other comments are left alone; what looks like a misspelt key gives "unknown_key".
KeyMap keys_of_header(const std::vector<HeaderKey>& lines, const std::string& file, Findings& findings);

// `winner` over `loser`, with a warning "key_differs" where both say something else.
KeyMap merged(const KeyMap& winner, const KeyMap& loser, Findings& findings);

// Sets what the keys say; a value that cannot be is an error of kind "key". Drive keys that differ from what `drive`
// holds already by more than 0.1 % are an error of kind "conflict"; the first stays.
void apply_drive_keys(const KeyMap& keys, DriveFacts& drive, Findings& findings);
void apply_experiment_keys(const KeyMap& keys, Experiment& experiment, Findings& findings);

}  // namespace flexspline::data
