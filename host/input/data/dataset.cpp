#include "host/input/data/dataset.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "host/common/signals/quantum.hpp"
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

std::optional<double> step_of(const Experiment& experiment, Column column) {
  const std::optional<double>& as_read = experiment.steps_as_read[static_cast<std::size_t>(column)];
  if (!as_read) return signals::quantum_of(experiment[column]);
  return *as_read > 0.0 ? as_read : std::nullopt;
}

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

void merge_facts(DriveFacts& ours, const DriveFacts& theirs, const FactSources& sources, Axis our_axis) {
  const auto refuse = [&](const char* name, const std::string& our, const std::string& their) {
    throw DataError(
        {{Severity::error, "conflict", "", 0, "",
          fmt::format("{} is {} in {} and {} in {}", name, our, sources.ours, their, sources.theirs), sources.remedy}});
  };
  const auto word = [](Axis axis) { return axis == Axis::rotary ? "rotary" : "linear"; };
  const Axis known = ours.axis.value_or(our_axis);
  if (theirs.axis && *theirs.axis != known) refuse("axis", word(known), word(*theirs.axis));
  if (!ours.axis) ours.axis = theirs.axis;
  constexpr std::pair<const char*, std::optional<double> DriveFacts::*> kNumbers[] = {
      {"gear_ratio", &DriveFacts::gear_ratio},
      {"torque_constant_nm_a", &DriveFacts::torque_constant_nm_a},
      {"pitch_m", &DriveFacts::pitch_m},
      {"pole_pairs", &DriveFacts::pole_pairs},
      {"motor_slots", &DriveFacts::motor_slots}};
  for (const auto& [name, fact] : kNumbers) {
    std::optional<double>& our = ours.*fact;
    const std::optional<double>& their = theirs.*fact;
    if (our && their && std::abs(*our - *their) > 1e-3 * std::abs(*our))
      refuse(name, fmt::format("{:g}", *our), fmt::format("{:g}", *their));
    if (!our) our = their;
  }
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
