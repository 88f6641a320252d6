// dataset.toml: which files belong to a data set, how their columns map to ours, what is known of the drive.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/findings.hpp"
#include "host/input/data/keys.hpp"

namespace flexspline::data {

// ours = scale * (theirs in SI by `unit`) + offset
struct ColumnMapping {
  std::string source;  // name in their file; ours if the file does not say
  double scale = 1.0;
  double offset = 0.0;
  std::string unit;  // empty: theirs is SI already, or `scale` converts
  std::size_t line = 0;
};

struct ExperimentEntry {
  std::filesystem::path file;  // the folder of dataset.toml is put before a relative one
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::optional<std::size_t> element;  // of struct arrays in a MAT file, from one
  KeyMap keys;
  std::size_t line = 0;
};

struct DatasetToml {
  std::filesystem::path file;
  std::vector<std::string> tolerate;             // kinds of findings that are warnings then, as `--tolerate` has them
  KeyMap drive;                                  // [drive]: keys of the drive
  KeyMap defaults;                               // [drive]: keys of experiments that hold for all of them
  std::map<std::string, ColumnMapping> columns;  // by our name, "time_s" included
  std::vector<ExperimentEntry> experiments;      // empty: all recordings in its folder
};

// Throws DataError (with what `findings` holds) if it cannot be read or parsed or is of another format. Unknown keys
// are warnings with the nearest known one; wrong types are kind "key".
DatasetToml read_dataset_toml(const std::filesystem::path& path, Findings& findings);

}  // namespace flexspline::data
