// The gain that a model will have on a drive, predicted before it is flashed.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "host/app/cli/inputs.hpp"

namespace flexspline::cli {

// Runs slow reversals on twins of which `model` is true, within its uncertainty, with the gains of `block`: without
// compensation, with the active block's model (where the block holds it) and with `model`. Prints it, and returns it as
// {"scenario","ratio","interval","draws","active":{"ratio","interval"} or null}, or null where a twin cannot be what
// the model says; the reason is printed then.
nlohmann::json predict_flash(const model::Model& model, const std::vector<std::uint8_t>& block,
                             const std::vector<std::uint8_t>& active, int draws, Console& console);

}  // namespace flexspline::cli
