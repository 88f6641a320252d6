#include "host/workbench/trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/catalogue/constants.hpp"
#include "host/deployment/bases.hpp"

namespace flexspline::workbench {
namespace {

constexpr int kDraws = 8;
// Peak over rated current where nothing says it: few servo drives allow less.
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

Rig rig_of(const model::Model& truth, const data::Dataset& dataset, std::string what) {
  closed_loop::Bench bench;
  for (const data::Experiment& e : dataset.experiments) {
    if (e.encoder_counts) bench.motor_counts = static_cast<int>(std::lround(*e.encoder_counts));
    if (e.output_encoder_counts) bench.output_counts = static_cast<int>(std::lround(*e.output_encoder_counts));
  }
  Rig rig;
  rig.what = std::move(what);
  bench.current_limit_a = kPeakCurrent * deployment::bases_of(truth, 1.0 / closed_loop::kTwinTickHz, 1.0).current_base;
  rig.plant = closed_loop::plant_text(truth, bench);
  // As a maker's data sheet says it; the loops follow from the model.
  rig.settings = fmt::format(
      "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = {}\n[output_encoder]\ncounts = {}\n[limits]\n"
      "current_a = {:.9g}\n[torque_sensor]\n",
      bench.motor_counts, bench.output_counts, bench.current_limit_a);
  rig.settings_origin = "the drive that is simulated";
  return rig;
}

Rig rig_beside(const std::vector<std::filesystem::path>& data, const data::Dataset& dataset) {
  for (const std::filesystem::path& place : data) {
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::is_directory(place, error) ? place : std::filesystem::absolute(place).parent_path();
    const std::filesystem::path file = folder / "truth.toml";
    if (!std::filesystem::exists(file, error)) continue;
    try {
      const model::ModelFile truth = model::parse(as_model(file), file.string(), catalogue::known_effects());
      return rig_of(truth.model, dataset, "the simulated drive that made these recordings (truth.toml)");
    } catch (const std::runtime_error&) {
      // It has what only its plant knows.
    }
  }
  return {};
}

const std::vector<std::string>& trial_scenarios() {
  static const std::vector<std::string> names{"sine", "slow-reversals", "trapezoid", "joint-trajectory",
                                              "constant-slow"};
  return names;
}

closed_loop::Comparison try_out(const Step& first, const Step& now, Rig& rig, const std::string& scenario,
                                const closed_loop::Runner& run, const Progress& say) {
  const bool is_known = rig.is_known();
  if (!is_known) rig = rig_of(now.model, *now.dataset, "a simulated drive of which the present model is true");
  closed_loop::Contest contest;
  contest.job.scenario = scenario;
  contest.job.plant = rig.plant;
  contest.job.plant_file = rig.plant_file;
  contest.job.keeps_trace = true;
  contest.settings = rig.settings;
  contest.settings_origin = rig.settings_origin;
  if (&first != &now) contest.contenders.push_back({"base", "", first.model});
  contest.contenders.push_back({"now", "", now.model});
  // Where the drive is the model, the prediction is the run.
  contest.draws = is_known ? kDraws : 0;
  const std::size_t models = contest.contenders.size(), all = static_cast<std::size_t>(contest.draws) * (models + 1);
  std::string stage;
  std::size_t before = 0;
  const closed_loop::Runner in_steps = closed_loop::in_groups(
      run, std::max(1U, std::thread::hardware_concurrency()),
      [&](std::size_t done) { say(fmt::format("{}: run {} of {}", stage, before + done + 1, all + models + 1)); });
  return closed_loop::compare(std::move(contest), in_steps, [&](std::string_view now_at) {
    if (now_at.starts_with("running")) before = all;
    stage = now_at;
    say(stage);
  });
}

nlohmann::json trial_json(const closed_loop::Comparison& comparison, const Rig& rig, bool is_model) {
  nlohmann::json answer = closed_loop::to_json(comparison);
  answer["plant"] = rig.what;
  answer["is_model"] = is_model;
  return answer;
}

}  // namespace flexspline::workbench
