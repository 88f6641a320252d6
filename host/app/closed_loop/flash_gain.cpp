#include "host/app/closed_loop/flash_gain.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/drive_link/deployment/pack.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::closed_loop {
namespace {

constexpr const char* kScenario = "slow-reversals";
constexpr double kSeconds = 3.0;

std::vector<std::uint8_t> packed(const model::Model& model, const std::string& settings) {
  deployment::PackOptions pack;
  pack.tick_hz = kTwinTickHz;
  pack.samples = 2'000;
  pack.bound = 1e-3;  // it is checked when it is packed for the drive
  pack.settings = settings;
  pack.settings_origin = "the block's gains";
  return deployment::pack(model, pack).bytes;
}

nlohmann::json json_of(const Prediction& p) {
  return {{"scenario", kScenario},
          {"ratio", output::json_number(p.ratio)},
          {"interval", {output::json_number(p.low), output::json_number(p.high)}},
          {"rms_error_rad", output::json_number(p.rms_error_rad)},
          {"rms_error_without_rad", output::json_number(p.rms_none_rad)},
          {"draws", p.draws},
          {"stable", p.stable}};
}

}  // namespace

std::vector<Prediction> predict_flash_gain(const model::Model& model, const std::vector<std::uint8_t>& block,
                                           const std::vector<std::uint8_t>& active, int draws, const Runner& run) {
  const deployment::Unpacked now = deployment::unpack(block);
  Question question;
  question.identified = model;
  question.hardware = twin_hardware_of(now);
  const std::string settings = settings_like(now, question.hardware);
  question.candidates.push_back({"new", packed(model, settings)});
  if (!active.empty())
    if (const auto before = deployment::unpack(active).model)
      question.candidates.push_back({"active", packed(*before, settings)});
  question.scenario = kScenario;
  question.seconds = kSeconds;
  question.draws = draws;
  return predict(question, run);
}

std::string flash_gain_in_words(const std::vector<Prediction>& found, data::Axis axis) {
  const Prediction& p = found.front();
  const char* const unit = axis == data::Axis::linear ? "mm" : "mrad";
  return fmt::format(
      "Predicted at slow reversals: {} {} with this model, {} {} without compensation: {} of it ({} to {} with 95 "
      "%){}.",
      output::number(1e3 * p.rms_error_rad, 3), unit, output::number(1e3 * p.rms_none_rad, 3), unit,
      output::number(p.ratio, 2), output::number(p.low, 2), output::number(p.high, 2),
      found.size() > 1 ? fmt::format("; with the active block's {} of it", output::number(found[1].ratio, 2)) : "");
}

nlohmann::json flash_gain_json(const std::vector<Prediction>& found) {
  nlohmann::json answer = json_of(found.front());
  answer["active"] = found.size() > 1 ? json_of(found[1]) : nlohmann::json();
  return answer;
}

}  // namespace flexspline::closed_loop
