// A drive in closed loop: without compensation, with a base model, with the model that an effect was added to.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/cli/hil_options.hpp"
#include "host/cli/report_option.hpp"
#include "host/cli/twin_runs.hpp"
#include "host/closed_loop/page.hpp"
#include "host/closed_loop/prediction.hpp"
#include "host/deployment/bases.hpp"
#include "host/deployment/pack.hpp"
#include "host/drive/settings_text.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"

namespace flexspline::cli {
namespace {

using closed_loop::ComparedRun;
using closed_loop::Comparison;
using nlohmann::json;
using output::number;

// The twin's.
constexpr double kTickHz = 20'000.0;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw UsageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

struct Given {
  std::string label;
  std::string name;
  model::Model model;
  std::vector<std::uint8_t> block;
};

// The first model's settings set the loops; the others get the same, whatever inertia they hold.
void pack_all(std::vector<Given>& all, const std::filesystem::path& settings) {
  std::string text = text_of(settings);
  for (Given& one : all) {
    deployment::PackOptions pack;
    pack.tick_hz = kTickHz;
    pack.samples = 20'000;
    pack.settings = text;
    pack.settings_origin = settings.string();
    one.block = deployment::pack(one.model, pack).bytes;
    if (&one != all.data()) continue;
    const double most_a = 1.99 * deployment::bases_of(one.model, 1.0 / kTickHz, 1.0).current_base;
    std::optional<double> lowered_from_a;
    text = drive::settings_text(deployment::unpack(one.block), most_a, lowered_from_a);
  }
}

std::vector<Given> models_of(const HilOptions& options, const std::filesystem::path& sheet) {
  std::vector<Given> all;
  const auto take = [&](std::string label, const std::filesystem::path& path, std::string name) {
    all.push_back({std::move(label), std::move(name), load_model(path).model, {}});
  };
  if (!options.base.empty() && options.model.empty())
    throw UsageError("--base is the model before an effect was added; name the one with it: --model MODEL");
  if (!options.base.empty()) take("base", options.base, options.base.string());
  if (!options.model.empty()) {
    take(options.base.empty() ? "model" : "added", options.model, options.model.string());
    return all;
  }
  take("base", sheet / "known-model.toml", "the maker's values");
  if (std::filesystem::exists(sheet / "whole-model.toml"))
    take("added", sheet / "whole-model.toml", "the true values, with the hidden effect");
  return all;
}

std::string verdict_of(const ComparedRun& run) {
  if (!run.outcome.fault.empty())
    return run.outcome.fault + (run.outcome.ends_in_fault ? ", switched off" : ", went on");
  if (run.outcome.limit_cycle) return fmt::format("limit cycle of {} rad", number(run.outcome.hold_swing_rad, 2));
  return run.outcome.stops > 0 ? fmt::format("{} stops", run.outcome.stops) : "-";
}

void print(const Comparison& c, Console& console) {
  console.line(console.bold(fmt::format("{}: {}", c.scenario, c.runs.front().outcome.what)));
  console.line(output::wrapped(
      fmt::format("{:g} s on {} at {:g} ticks a second. All runs with the same loops: velocity {:.3g} Hz with an "
                  "integrator of {:.3g} 1/s, position {:.3g} Hz.",
                  c.seconds, c.processor.empty() ? "the software board" : "an emulated processor", c.tick_hz,
                  c.velocity_loop_hz, c.integrator_per_s, c.position_loop_hz)));
  output::Table table({"compensation", "rms error", "peak error", "unit", "of none", "predicted", "95 % interval",
                       "rms current", "peak", "unit", "what happened"},
                      "lrrlrrrrrll");
  for (const ComparedRun& run : c.runs) {
    const closed_loop::Outcome& o = run.outcome;
    table.row(
        {run.label, number(1e3 * o.rms_error_rad), number(1e3 * o.peak_error_rad), "mrad",
         number(o.rms_error_rad / c.runs.front().outcome.rms_error_rad, 3),
         run.predicted ? number(run.predicted->ratio, 3) : "-",
         run.predicted ? fmt::format("{} to {}", number(run.predicted->low, 2), number(run.predicted->high, 2)) : "-",
         number(o.rms_current_a, 3), number(o.peak_current_a, 3), "A", verdict_of(run)});
  }
  console.line(table.text());
  for (const ComparedRun& run : c.runs)
    if (!run.model.empty()) console.line(fmt::format("  {:<6} {}", run.label, run.model));
  if (!c.no_prediction.empty()) console.line(output::wrapped("No prediction: " + c.no_prediction));
  console.line(fmt::format("  {} times real time.", number(c.realtime_factor, 2)));
}

}  // namespace

closed_loop::Comparison run_closed_loop(const HilOptions& options, Console& console) {
  if (options.seconds != 0.0 && options.seconds < 1.1)
    throw UsageError("--seconds has to be above 1.1: the first second fades the motion in and is not judged");
  if (options.draws != 0 && (options.draws < 3 || options.draws > 200))
    throw UsageError("--draws has to be 0, or 3 to 200");
  require_report_place(options.report);
  closed_loop::Job job;
  job.scenario = options.scenario;
  job.plant_file = options.plant.string();
  job.with = options.with;
  job.hide = options.hide;
  job.seconds = options.seconds;
  job.seed = options.seed;
  job.processor = options.processor.string();
  const ScratchFolder sheet;
  fetch_data_sheet(job, sheet.path());
  console.progress("packing the models");
  std::vector<Given> models = models_of(options, sheet.path());
  const std::filesystem::path settings = options.settings.empty() ? sheet.path() / "settings.toml" : options.settings;
  pack_all(models, settings);
  const deployment::Unpacked first = deployment::unpack(models.front().block);

  Comparison c;
  c.scenario = options.scenario;
  c.processor = options.processor.string();
  c.take_gains(deployment::parse_drive_setup(text_of(settings), settings.string(), models.front().model,
                                             deployment::bases_of(models.front().model, 1.0 / kTickHz, 1.0)));
  const closed_loop::Runner runner = twin_runner();
  std::vector<closed_loop::Prediction> predicted;
  if (options.draws > 0) {
    console.progress("predicting the gain");
    try {
      closed_loop::Question question;
      question.believed = models.back().model;
      question.bench = closed_loop::bench_of(first);
      for (const Given& one : models) question.candidates.push_back({one.label, one.block});
      question.scenario = options.scenario;
      question.seconds = options.seconds;
      question.draws = options.draws;
      question.seed = options.seed;
      predicted = closed_loop::predict(question, runner);
    } catch (const std::runtime_error& error) {
      c.no_prediction = error.what();
    }
  }
  console.progress("running the drive");
  job.keeps_trace = !options.report.empty() || !options.picture.empty();
  std::vector<closed_loop::Job> jobs;
  job.block = models.front().block;
  jobs.push_back(job);
  job.compensation = true;
  for (const Given& one : models) {
    job.block = one.block;
    jobs.push_back(job);
  }
  std::vector<closed_loop::Outcome> outcomes = runner(jobs);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    ComparedRun run;
    run.label = i == 0 ? "none" : models[i - 1].label;
    run.model = i == 0 ? "" : models[i - 1].name;
    run.outcome = std::move(outcomes[i]);
    if (i > 0 && i <= predicted.size()) run.predicted = predicted[i - 1];
    c.runs.push_back(std::move(run));
  }
  c.finish();
  print(c, console);
  if (!options.report.empty()) {
    closed_loop::write_page(options.report, c);
    console.line(fmt::format("  {} shows this with plots; open it in a browser.", options.report.string()));
  }
  if (!options.picture.empty()) model::save(options.picture, closed_loop::picture(c));
  return c;
}

int run(const HilOptions& options, Console& console) {
  const closed_loop::Comparison comparison = run_closed_loop(options, console);
  output::save_json(options.json, closed_loop::to_json(comparison));
  return kDone;
}

}  // namespace flexspline::cli
