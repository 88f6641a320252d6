#include "host/app/cli/flash_prediction.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/twin_runs.hpp"
#include "host/app/closed_loop/prediction.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

constexpr const char* kScenario = "slow-reversals";
constexpr double kSeconds = 3.0;
constexpr double kTwinTickHz = 20'000.0;

std::vector<std::uint8_t> packed(const model::Model& model, const std::string& settings) {
  deployment::PackOptions pack;
  pack.tick_hz = kTwinTickHz;
  pack.samples = 2'000;
  pack.bound = 1e-3;  // it is checked when it is packed for the drive
  pack.settings = settings;
  pack.settings_origin = "the block's gains";
  return deployment::pack(model, pack).bytes;
}

nlohmann::json json_of(const closed_loop::Prediction& p) {
  return {{"scenario", kScenario},
          {"ratio", output::json_number(p.ratio)},
          {"interval", {output::json_number(p.low), output::json_number(p.high)}},
          {"rms_error_rad", output::json_number(p.rms_error_rad)},
          {"rms_error_without_rad", output::json_number(p.rms_none_rad)},
          {"draws", p.draws},
          {"stable", p.stable}};
}

}  // namespace

nlohmann::json predict_flash(const model::Model& model, const std::vector<std::uint8_t>& block,
                             const std::vector<std::uint8_t>& active, int draws, Console& console) {
  if (draws == 0) return nullptr;
  console.progress("predicting the gain");
  try {
    const deployment::Unpacked now = deployment::unpack(block);
    closed_loop::Question question;
    question.identified = model;
    question.hardware = closed_loop::twin_hardware_of(now);
    const std::string settings = closed_loop::settings_like(now, question.hardware);
    question.candidates.push_back({"new", packed(model, settings)});
    if (!active.empty())
      if (const auto before = deployment::unpack(active).model)
        question.candidates.push_back({"active", packed(*before, settings)});
    question.scenario = kScenario;
    question.seconds = kSeconds;
    question.draws = draws;
    const std::vector<closed_loop::Prediction> found = closed_loop::predict(question, twin_runner());
    const closed_loop::Prediction& p = found.front();
    console.line(output::wrapped(fmt::format(
        "Predicted at slow reversals: {} mrad with this model, {} mrad without compensation: {} of it ({} to {} with "
        "95 %){}.",
        output::number(1e3 * p.rms_error_rad, 3), output::number(1e3 * p.rms_none_rad, 3), output::number(p.ratio, 2),
        output::number(p.low, 2), output::number(p.high, 2),
        found.size() > 1 ? fmt::format("; with the active block's {} of it", output::number(found[1].ratio, 2)) : "")));
    if (!p.stable) console.warn("in the prediction the drive had a fault with this model");
    nlohmann::json answer = json_of(p);
    answer["active"] = found.size() > 1 ? json_of(found[1]) : nlohmann::json();
    return answer;
  } catch (const std::runtime_error& error) {
    console.line(output::wrapped(fmt::format("The gain cannot be predicted: {}", error.what())));
    return nullptr;
  }
}

}  // namespace flexspline::cli
