#include "host/app/workbench/closed_loop_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/app/closed_loop/flash_gain.hpp"
#include "host/drive_link/deployment/bases.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::workbench {
namespace {

constexpr int kDraws = 8, kDrawsOfFlash = 4;  // the latter as `flexspline flash`
// Peak over rated current where it is not given: few servo drives allow less.
constexpr double kPeakCurrent = 1.6;

// A truth.toml without what a model does not have: what was hidden, and how each run was.
std::string as_model(const std::filesystem::path& file) {
  std::ifstream lines(file);
  std::string model, line;
  bool is_head = true;
  while (std::getline(lines, line) && !line.starts_with("[[run]]")) {
    is_head = is_head && !line.starts_with('[');
    const bool is_known = !line.starts_with("hidden") && !line.starts_with("seed") && !line.starts_with("scale");
    if (!is_head || is_known) model += line + "\n";
  }
  return model;
}

}  // namespace

SimulatedPlant plant_of(const model::Model& truth, const data::Dataset& dataset, std::string what) {
  closed_loop::TwinHardware hardware;
  for (const data::Experiment& e : dataset.experiments) {
    if (e.encoder_counts) hardware.motor_counts = static_cast<int>(std::lround(*e.encoder_counts));
    if (e.output_encoder_counts) hardware.output_counts = static_cast<int>(std::lround(*e.output_encoder_counts));
  }
  SimulatedPlant plant_setup;
  plant_setup.what = std::move(what);
  hardware.current_limit_a = kPeakCurrent * deployment::bases_of(truth, 1.0 / closed_loop::kTwinTickHz).current_base;
  plant_setup.plant = closed_loop::plant_text(truth, hardware);
  // As in a manufacturer's data sheet; the loops follow from the model.
  plant_setup.settings = fmt::format(
      "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = {}\n[output_encoder]\ncounts = {}\n[limits]\n"
      "current_a = {:.9g}\n[torque_sensor]\n",
      hardware.motor_counts, hardware.output_counts, hardware.current_limit_a);
  plant_setup.settings_origin = "the drive that is simulated";
  return plant_setup;
}

SimulatedPlant plant_of_recordings(const std::vector<std::filesystem::path>& data, const data::Dataset& dataset) {
  for (const std::filesystem::path& place : data) {
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::is_directory(place, error) ? place : std::filesystem::absolute(place).parent_path();
    const std::filesystem::path file = folder / "truth.toml";
    if (!std::filesystem::exists(file, error)) continue;
    try {
      const model::ModelFile truth = model::parse(as_model(file), file.string(), catalogue::known_effects());
      return plant_of(truth.model, dataset, "the simulated drive of these recordings (truth.toml)");
    } catch (const std::runtime_error&) {
      // The settings contain data that only the plant knows.
    }
  }
  return {};
}

const std::vector<std::string>& closed_loop_scenarios() {
  static const std::vector<std::string> names{"sine", "slow-reversals", "trapezoid", "joint-trajectory",
                                              "constant-slow"};
  return names;
}

closed_loop::Comparison run_closed_loop(const Step& first, const Step& now, SimulatedPlant& plant_setup,
                                        const std::string& scenario, const closed_loop::Runner& run,
                                        const Progress& progress) {
  const bool is_known = plant_setup.is_known();
  if (!is_known)
    plant_setup = plant_of(now.model, *now.dataset, "a simulated drive of which the present model is true");
  closed_loop::ComparisonSetup setup;
  setup.job.scenario = scenario;
  setup.job.plant = plant_setup.plant;
  setup.job.plant_file = plant_setup.plant_file;
  setup.job.keeps_trace = true;
  setup.settings = plant_setup.settings;
  setup.settings_origin = plant_setup.settings_origin;
  if (&first != &now) setup.models.push_back({"base", "", first.model});
  setup.models.push_back({"now", "", now.model});
  // Where the plant is the model itself, no prediction is needed.
  setup.draws = is_known ? kDraws : 0;
  const std::size_t models = setup.models.size(), all = static_cast<std::size_t>(setup.draws) * (models + 1);
  std::string stage;
  std::size_t before = 0;
  const closed_loop::Runner in_steps = closed_loop::in_groups(
      run, std::max(1U, std::thread::hardware_concurrency()),
      [&](std::size_t done) { progress(fmt::format("{}: run {} of {}", stage, before + done + 1, all + models + 1)); });
  return closed_loop::compare(std::move(setup), in_steps, [&](std::string_view now_at) {
    if (now_at.starts_with("running")) before = all;
    stage = now_at;
    progress(stage);
  });
}

nlohmann::json closed_loop_json(const closed_loop::Comparison& comparison, const SimulatedPlant& plant_setup,
                                bool is_model) {
  nlohmann::json answer = closed_loop::to_json(comparison);
  answer["plant"] = plant_setup.what;
  answer["is_model"] = is_model;
  return answer;
}

nlohmann::json predicted_gain(const model::Model& model, const ComparedBlocks& blocks, const closed_loop::Runner& run,
                              const Progress& progress) {
  progress("predicting the gain");
  const closed_loop::Runner in_steps =
      closed_loop::in_groups(run, std::max(1U, std::thread::hardware_concurrency()),
                             [&](std::size_t done) { progress(fmt::format("predicting the gain: run {}", done + 1)); });
  try {
    const auto found = closed_loop::predict_flash_gain(model, blocks.made, blocks.active, kDrawsOfFlash, in_steps);
    nlohmann::json answer = closed_loop::flash_gain_json(found);
    answer["in_words"] = closed_loop::flash_gain_in_words(found, model.drive.axis);
    return answer;
  } catch (const std::runtime_error& impossible) {
    return {{"problem", impossible.what()}};
  }
}

}  // namespace flexspline::workbench
