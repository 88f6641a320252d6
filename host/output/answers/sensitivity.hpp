// The JSON answer of `flexspline sensitivity`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/engine/sensitivity/sensitivity.hpp"

namespace flexspline::output {

// "flexspline-sensitivity/1", as JSON.md has it. What is not known or not finite is null.
nlohmann::json sensitivity_json(const sensitivity::Sensitivity& found);

}  // namespace flexspline::output
