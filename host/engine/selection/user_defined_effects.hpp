// User-defined effects for `add`: a table over a signal, or a formula with parameters.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::selection {

// What is reported in addition to the name of the effect.
struct UserDefinition {
  std::string balance;                // "motor", "transmission", "load"; empty: where the signals belong
  std::optional<std::size_t> points;  // of a table; else chosen from the data
  std::string formula;
  std::vector<std::string> parameters;  // of the formula: "b=0.1..50:rad/s", "a:N*m"
};

// Whether the text names a user-defined effect: "table_effect:velocity", "expression_effect".
bool names_user_defined_effect(std::string_view text);

// "table_effect:velocity" or "table_effect:torque*direction" without points; "expression_effect" as in `given`. The id
// is free in `model`. Throws model::ModelError with what is wrong and what is known instead.
model::Effect user_defined_effect(std::string_view text, const UserDefinition& given, const model::Model& model);

// "b=0.1..50:rad/s": name, bounds and unit; bounds (either end) and unit may be missing. Throws model::ModelError.
model::Parameter parse_parameter(std::string_view text);

// Learns the points of a table together with the effects of an identified model. Throws data::DataError where the
// signal does not vary, or where the table does not lower the error on samples that its fit did not see.
estimation::LearnedTable learn(estimation::Identification& base, const model::Effect& table,
                               const UserDefinition& given);

}  // namespace flexspline::selection
