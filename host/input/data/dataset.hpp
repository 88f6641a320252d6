// A data set in memory: experiments on one uniform time base each, in SI units and the signs of the contract.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/finding.hpp"

namespace flexspline::data {

// The columns that the tool understands, in the order of the contract. On a linear axis the names stay and the
// quantities are m, m/s and N.
enum class Column : std::uint8_t {
  current,
  motor_torque,
  motor_position,
  motor_velocity,
  output_position,
  output_velocity,
  torque,
  temperature,
  load_torque,
  velocity_command,
  position_command,
  current_command,
};
inline constexpr std::size_t kColumns = 12;

// "current_a", "motor_position_rad", ...: the name in files.
std::string_view column_name(Column column);
std::optional<Column> column_from_name(std::string_view name);

enum class Role : std::uint8_t { fit, holdout };
enum class Load : std::uint8_t { free, locked };
enum class CurrentHold : std::uint8_t { zoh, none };
enum class PositionZero : std::uint8_t { absolute, index, none };
enum class Axis : std::uint8_t { rotary, linear };

// SI unit of a column: "rad" or "m", "rad/s" or "m/s", "N*m" or "N", "A", "degC".
std::string unit_of(Column column, Axis axis);

// Half-open range of samples without a gap in time; nothing is filtered across its ends.
struct Segment {
  std::size_t first = 0;
  std::size_t last = 0;
};

// One experiment: sampled uniformly within each segment.
struct Experiment {
  std::string name;
  std::filesystem::path file;
  Role role = Role::fit;
  Load load = Load::free;
  // Where nothing is stated the effort is taken as a command that is held, which is what most drives log.
  CurrentHold current_hold = CurrentHold::zoh;
  bool current_hold_stated = false;  // by a key; an assumed effort is not an excuse for clipping
  std::string replicate_of;          // empty: of none
  double sample_s = 0.0;
  std::vector<double> time_s;
  std::array<std::vector<double>, kColumns> columns;      // empty: not measured
  std::array<std::optional<double>, kColumns> noise_std;  // stated by the user, in the column's unit
  // Smallest steps that were found as the columns were read, 0 where there are none; see step_of().
  std::array<std::optional<double>, kColumns> steps_as_read;
  std::vector<Segment> segments;
  // Samples that must not be used (clipped, for one), as found by `load`; same length as time_s.
  std::vector<std::uint8_t> masked;
  // Of the motor's encoder and of the output's: in a turn, on a linear axis in a metre. See encoder_step().
  std::optional<double> encoder_counts, output_encoder_counts;
  PositionZero motor_position_zero = PositionZero::none;
  PositionZero output_position_zero = PositionZero::none;
  std::vector<std::string> unused_columns;  // names in the file that are not mapped

  std::size_t size() const { return time_s.size(); }
  // The effort column is known to be a held command, not only taken for one.
  bool is_held_command() const { return current_hold_stated && current_hold == CurrentHold::zoh; }
  bool has(Column column) const { return !columns[static_cast<std::size_t>(column)].empty(); }
  const std::vector<double>& operator[](Column column) const { return columns[static_cast<std::size_t>(column)]; }
  std::vector<double>& operator[](Column column) { return columns[static_cast<std::size_t>(column)]; }
};

// The drive's facts in the data set; absent where not given.
struct DriveFacts {
  std::optional<Axis> axis;
  std::optional<double> gear_ratio;
  std::optional<double> torque_constant_nm_a;
  std::optional<double> pitch_m;
  std::optional<double> pole_pairs;   // of the motor
  std::optional<double> motor_slots;  // of its stator
};

struct Dataset {
  DriveFacts drive;
  std::vector<Experiment> experiments;
  std::vector<Finding> findings;  // warnings and notes; errors are thrown

  bool has(Column column) const {
    for (const Experiment& e : experiments)
      if (e.has(column)) return true;
    return false;
  }
};

struct LoadOptions {
  std::vector<std::string> tolerate;  // kinds of findings that are warnings then, not errors
  bool holdout = false;               // every experiment is used for scoring, none for fitting (`--holdout`)
  std::optional<Axis> axis = {};      // of the drive, where the measurements do not state it (default: rotary)
};

// Adds to `ours` what `theirs` alone states. Throws DataError of kind "conflict" where both state another value: "axis
// is rotary in OURS and linear in THEIRS", with the remedy. Measurements that state no axis were read by `our_axis`.
struct FactSources {
  std::string ours;
  std::string theirs;
  std::string remedy;
};
void merge_facts(DriveFacts& ours, const DriveFacts& theirs, const FactSources& sources, Axis our_axis = Axis::rotary);

// Smallest step of an encoder with so many counts, rad or m; nothing where the counts are not stated.
std::optional<double> encoder_step(const std::optional<double>& counts, Axis axis);

// Smallest step of a column, where all its steps are multiples of one: as it was read, because resampling and other
// units hide it; else as the values are.
std::optional<double> step_of(const Experiment& experiment, Column column);

// Reads any number of files, folders and dataset.tomls. A folder with a dataset.toml is read by that file, one
// without by its CSV and MAT files in the order of their names; a dataset.toml names which files belong and how columns
// map. Throws DataError with all findings of severity error.
Dataset load(const std::vector<std::filesystem::path>& paths, const LoadOptions& options = {});

// Throws DataError of kind "missing_column" unless every experiment has at least one column of each group; the
// message says how to map one. `task` is what needs them: "identify".
void require(const Dataset& dataset, std::span<const std::vector<Column>> any_of_each, std::string_view task);

}  // namespace flexspline::data
