#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/output/json.hpp"
#include "host/output/plan.hpp"
#include "host/planning/design.hpp"

namespace flexspline::cli {
namespace {

planning::MotionSettings setting_of(const PlanOptions& options, const model::Model& model,
                                    const data::Dataset* dataset) {
  planning::MotionSettings setting = planning::setting_of(model, dataset);
  planning::Limits& limits = setting.limits;
  const double known_current = limits.current_a;
  limits.current_a = options.current_a.value_or(limits.current_a);
  limits.velocity_rad_s = options.velocity_rad_s.value_or(limits.velocity_rad_s);
  limits.travel_rad = options.travel_rad.value_or(limits.travel_rad);
  limits.duration_s = options.duration_s.value_or(limits.duration_s);
  // What the gear carries, and what can be applied to it, go with the current that there is.
  const double share = known_current > 0.0 ? std::min(1.0, limits.current_a / known_current) : 1.0;
  setting.locked_current_a = known_current > 0.0 ? setting.locked_current_a * share : limits.current_a;
  limits.load_torque_nm = options.load_torque_nm.value_or(limits.load_torque_nm * share);
  setting.run_s = options.run_s.value_or(setting.run_s);
  if (options.temperatures_c.size() == 2) {
    setting.cold_c = std::min(options.temperatures_c[0], options.temperatures_c[1]);
    setting.warm_c = std::max(options.temperatures_c[0], options.temperatures_c[1]);
    setting.temperature = true;
  }
  for (const std::string& what : options.without) {
    if (what == "off") setting.off = false;
    if (what == "locked") setting.locked = false;
    if (what == "load") setting.external_load = false;
    if (what == "temperature") setting.temperature = false;
  }
  if (!(limits.current_a > 0.0))
    throw UsageError("the largest current is not known; state rated_current_a in the model's [drive], or --current-a");
  if (!(limits.velocity_rad_s > 0.0))
    throw UsageError(
        "the largest velocity is not known; state rated_velocity_rad_s in the model's [drive], or --velocity-rad-s");
  return setting;
}

// In seconds: as the user states it, else that of the data. Logs of current loops are faster than any motion needs, and
// each sample is rehearsed some hundred times.
double sample_time(const PlanOptions& options, const data::Dataset* dataset, double run_s, Console& console) {
  constexpr double kFastestHz = 20e3, kMostSamples = 1e6;
  double hz = options.sample_hz.value_or(1000.0);
  if (!options.sample_hz && dataset && !dataset->experiments.empty()) {
    hz = 1.0 / dataset->experiments.front().sample_s;
    if (hz > kFastestHz)
      console.warn(fmt::format("the data have {:g} samples a second; the plan is for {:g}; --sample-hz states another",
                               hz, kFastestHz));
    hz = std::min(hz, kFastestHz);
  }
  if (run_s * hz > kMostSamples)
    throw UsageError(
        fmt::format("a run of {:g} s at {:g} Hz has more than {:g} samples; state a lower --sample-hz, or "
                    "shorter runs by --run-s",
                    run_s, hz, kMostSamples));
  return 1.0 / hz;
}

}  // namespace

int run(const PlanOptions& options, Console& console) {
  const model::ModelFile file = load_searched_model(options.model);
  std::optional<data::Dataset> dataset;
  if (!options.data.data.empty()) dataset = load(options.data, console);
  planning::PlanRequest question;
  question.model = &file.model;
  question.dataset = dataset ? &*dataset : nullptr;
  question.pipeline = options.pipeline.options();
  question.setting = setting_of(options, file.model, question.dataset);
  question.sensors = planning::sensors_of(question.dataset);
  question.sample_s = sample_time(options, dataset ? &*dataset : nullptr, question.setting.run_s, console);
  question.most_motions = static_cast<std::size_t>(options.motions);
  question.progress = [&](std::string_view stage) { console.progress(stage); };
  const planning::Design design = options.separate.empty()
                                      ? planning::excite(question)
                                      : planning::separate(question, options.separate[0], options.separate[1]);
  for (const std::string& warning : design.warnings) console.warn(warning);
  model::save(options.out, planning::text_of(design.plan));
  output::print_plan(console, design, options.out.string());
  output::save_json(options.json, output::plan_json(design));
  return kDone;
}

}  // namespace flexspline::cli
