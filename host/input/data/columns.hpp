// Which columns of a file become which of ours, and by what arithmetic.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/input/data/dataset_toml.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {

struct PlannedColumn {
  Column column = Column::current;
  std::size_t column_index = 0;  // into ColumnPlan::wanted
  ColumnMapping mapping;
  bool mapped = false;  // by dataset.toml, not by its name
};

struct ColumnPlan {
  std::vector<std::size_t> wanted;  // indices into Recording::names()
  std::vector<std::string> wanted_names;
  std::size_t time_column = 0;
  ColumnMapping time;
  std::string mapping_file;  // dataset.toml, if one maps
  std::vector<PlannedColumn> columns;
  std::vector<std::string> unused;
};

// Empty if the file has no time or no column of ours; the findings say what to map. `element`: of struct arrays, where
// "log.iq" means "log(2).iq" then.
std::optional<ColumnPlan> plan_columns(const Recording& recording, const std::filesystem::path& path,
                                       const DatasetToml* toml, std::optional<std::size_t> element, Findings& findings);

// Theirs to ours: the unit first, then scale and offset.
struct Conversion {
  double factor = 1.0;
  double offset = 0.0;
  double operator()(double theirs) const { return factor * theirs + offset; }
};

// Units that are not known or do not fit are errors of kind "mapping" that list those that do.
std::optional<Conversion> conversion_of(const PlannedColumn& planned, const ColumnPlan& plan, Axis axis,
                                        const Experiment& experiment, Findings& findings);
std::optional<Conversion> time_conversion(const ColumnPlan& plan, Findings& findings);

}  // namespace flexspline::data
