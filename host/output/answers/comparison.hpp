// A model against measurements, as a table and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/engine/comparison/compare.hpp"

namespace flexspline::output {

// "flexspline-compare/1". What is not known or not finite is null.
nlohmann::json comparison_json(const comparison::Comparison& comparison);

// For a terminal: experiments in the order of the data, then the three regions with the largest excess, in words.
std::string comparison_table(const comparison::Comparison& comparison);

}  // namespace flexspline::output
