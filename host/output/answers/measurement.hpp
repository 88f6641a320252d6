// What the data show of a drive without a model, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/engine/measurement/measure.hpp"

namespace flexspline::output {

// Responses with their resonances, noise, distortion, and what could not be determined.
std::string measurement_text(const measurement::Measurement& found);

// "flexspline-measure/1".
nlohmann::json measurement_json(const measurement::Measurement& found);

}  // namespace flexspline::output
