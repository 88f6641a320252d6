// The parts of a document, each from the same view of model and measurement.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/output/report/view.hpp"

namespace flexspline::report {

// One entry an experiment: its balances and free runs over time.
nlohmann::json traces(View& view);
// Residual over what it may depend on, one entry a balance.
nlohmann::json residual_maps(const View& view);
// Torque against torsion, measured and modelled, one entry a record that is loaded.
nlohmann::json hysteresis_loops(const View& view);
// Friction over motor velocity, measured and by effect; null where the model has none.
nlohmann::json friction_curve(View& view);
// Parameters with spreads and intervals.
nlohmann::json parameters(const Subject& subject, const View& view);
// Error before and after, in total and by experiment; null without an addition.
nlohmann::json addition(const Subject& subject, const View& view);
// The page's first sentence, and the figures behind it: {"verdict", "good", "headline"}.
nlohmann::json verdict(const Subject& subject, const View& view);

}  // namespace flexspline::report
