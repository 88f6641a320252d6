// Ways to a derivative compared, as text, JSON and a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/engine/measurement/derivatives.hpp"

namespace flexspline::output {

std::string derivatives_text(const std::vector<measurement::DerivativeComparison>& found, data::Axis axis);

// "flexspline-derivatives/1"; without the signals.
nlohmann::json derivatives_json(const std::vector<measurement::DerivativeComparison>& found, data::Axis axis);

// Velocity and acceleration from `from_s` to `to_s` by four of the methods, as SVG. Throws std::invalid_argument where
// the record has fewer than two samples there.
std::string derivatives_picture(const measurement::DerivativeComparison& found, data::Axis axis, double from_s,
                                double to_s);

}  // namespace flexspline::output
