// JSON as the contract has it: numbers that are not known or not finite are null.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::output {

nlohmann::json json_number(double value);
nlohmann::json json_number(const std::optional<double>& value);
nlohmann::json json_numbers(const std::vector<double>& values);

// {"id","effect","parameter","value","unit","std","interval":[lo,hi]}: the form of a parameter in all answers.
nlohmann::json json_parameter(const estimation::Estimate& estimate);

// Adds "average", "spread_percent", "reliable", "counted", "left_out" and "per_experiment".
void add_by_experiment(nlohmann::json& to, const estimation::ByExperiment& values);

// Whole or not at all; `where` is a file, or "-" for standard output. Nothing is done where it is empty.
// Throws std::runtime_error with path and reason.
void save_json(const std::string& where, const nlohmann::json& json);

}  // namespace flexspline::output
