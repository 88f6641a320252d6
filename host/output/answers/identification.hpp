// What an identification found, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::output {

// How the data were prepared: cut-offs and where they come from, decimation, mask, alignment of the effort.
std::string pipeline_text(const estimation::PreparedData& prepared);

// Table by experiment (as the report's tables 3 to 8), pooled values with 95 % intervals, derived values, errors of
// the balances.
std::string identification_text(const estimation::Identification& found);
// In the words of the axis.
std::vector<std::string> warnings_of(const estimation::Identification& found);

// "flexspline-identify/1"; `intervals` by their name: profile.
nlohmann::json identification_json(const estimation::Identification& found, const std::string& intervals);

// "N*m", or "N" on a linear axis.
std::string torque_unit(data::Axis axis);

}  // namespace flexspline::output
