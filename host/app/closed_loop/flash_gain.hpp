// The gain that a model will have on a drive, predicted before it is flashed.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/app/closed_loop/prediction.hpp"

namespace flexspline::closed_loop {

// Slow reversals on twins of which `model` is true, within its uncertainty, with the gains of `block`: first with
// `model`, then with the active block's model, where the block holds it. Throws std::runtime_error with the reason
// where a twin cannot be what the model says.
std::vector<Prediction> predict_flash_gain(const model::Model& model, const std::vector<std::uint8_t>& block,
                                           const std::vector<std::uint8_t>& active, int draws, const Runner& run);

std::string flash_gain_in_words(const std::vector<Prediction>& found, data::Axis axis);
// {"scenario","ratio","interval","draws","active":{"ratio","interval"} or null}.
nlohmann::json flash_gain_json(const std::vector<Prediction>& found);

}  // namespace flexspline::closed_loop
