#include "host/input/data/dataset.hpp"

#include <fmt/format.h>

#include <numbers>

#include "host/input/data/units.hpp"

namespace flexspline::data {
namespace {

constexpr std::array<std::string_view, kColumns> kNames = {
    "current_a",
    "motor_torque_nm",
    "motor_position_rad",
    "motor_velocity_rad_s",
    "output_position_rad",
    "output_velocity_rad_s",
    "torque_nm",
    "temperature_c",
    "load_torque_nm",
    "velocity_command_rad_s",
    "position_command_rad",
    "current_command_a",
};

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

std::optional<double> encoder_step(const std::optional<double>& counts, Axis axis) {
  if (!counts || !(*counts > 0.0)) return std::nullopt;
  return (axis == Axis::rotary ? 2.0 * std::numbers::pi : 1.0) / *counts;
}

std::string_view column_name(Column column) {
  return kNames[static_cast<std::size_t>(column)];
}

std::optional<Column> column_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kColumns; ++i)
    if (kNames[i] == name) return static_cast<Column>(i);
  return std::nullopt;
}

std::string unit_of(Column column, Axis axis) {
  return std::string(si_unit(quantity_of(column, axis)));
}

void require(const Dataset& dataset, std::span<const std::vector<Column>> any_of_each, std::string_view task) {
  std::vector<Finding> missing;
  for (const Experiment& experiment : dataset.experiments) {
    for (const std::vector<Column>& group : any_of_each) {
      bool found = group.empty();
      std::string names;
      for (const Column column : group) {
        found = found || experiment.has(column);
        names += (names.empty() ? "" : " or ") + std::string(column_name(column));
      }
      if (found) continue;
      std::string remedy = fmt::format(
          "record it, or map a column to it in dataset.toml: [columns.{}] with source = \"NAME IN THE FILE\" and unit",
          column_name(group.front()));
      if (!experiment.unused_columns.empty())
        remedy += fmt::format(" (columns not used so far: {})", listed(experiment.unused_columns));
      missing.push_back(Finding{
          Severity::error, "missing_column", experiment.file.string(), 0, "",
          fmt::format("{} needs {}, and experiment \"{}\" has no such column", task, names, experiment.name), remedy});
    }
  }
  if (!missing.empty()) throw DataError(missing);
}

}  // namespace flexspline::data
