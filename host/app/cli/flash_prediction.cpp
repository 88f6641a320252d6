#include "host/app/cli/flash_prediction.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/twin_runs.hpp"
#include "host/app/closed_loop/flash_gain.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {

nlohmann::json predict_flash(const model::Model& model, const std::vector<std::uint8_t>& block,
                             const std::vector<std::uint8_t>& active, int draws, Console& console) {
  if (draws == 0) return nullptr;
  console.progress("predicting the gain");
  try {
    const auto found = closed_loop::predict_flash_gain(model, block, active, draws, twin_runner());
    console.line(output::wrapped(closed_loop::flash_gain_in_words(found, model.drive.axis)));
    if (!found.front().stable) console.warn("in the prediction the drive had a fault with this model");
    return closed_loop::flash_gain_json(found);
  } catch (const std::runtime_error& error) {
    console.line(output::wrapped(fmt::format("The gain cannot be predicted: {}", error.what())));
    return nullptr;
  }
}

}  // namespace flexspline::cli
