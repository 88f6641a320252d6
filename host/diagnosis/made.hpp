// Effects that users make, as `add` takes them: a table over a signal, a formula with parameters.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/model/model.hpp"
#include "host/regression/identify.hpp"

namespace flexspline::diagnosis {

// What is said beside the name of the effect.
struct Made {
  std::string balance;                // "motor", "transmission", "load"; empty: where the signals belong
  std::optional<std::size_t> points;  // of a table; else chosen from the data
  std::string formula;
  std::vector<std::string> parameters;  // of the formula: "b=0.1..50:rad/s", "a:N*m"
};

// Whether the text names an effect that users make: "table_effect:velocity", "expression_effect".
bool names_made_effect(std::string_view text);

// "table_effect:velocity" or "table_effect:torque*direction" without points; "expression_effect" with what `made` says.
// The id is free in `model`. Throws model::ModelError with what is wrong and what is known instead.
model::Effect made_effect(std::string_view text, const Made& made, const model::Model& model);

// "b=0.1..50:rad/s": name, bounds and unit; bounds (either end) and unit may be missing. Throws model::ModelError.
model::Parameter parse_parameter(std::string_view text);

// Below this a table is noise that was fitted: see regression::LearnedTable::score.
inline constexpr double kTableScore = 20.0;

// Learns the points of a table beside the effects of an identified model. Throws data::DataError where the signal does
// not vary, or where the table does not lower the error on rows that its fit did not see.
regression::LearnedTable learn(regression::Identification& base, const model::Effect& table, const Made& made);

}  // namespace flexspline::diagnosis
