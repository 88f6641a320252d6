// A drive in closed loop: without compensation, with a base model, with the model that an effect was added to.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/app/cli/command.hpp"
#include "host/app/cli/command_hil.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/app/cli/twin_runs.hpp"
#include "host/app/closed_loop/compare.hpp"
#include "host/common/system/temporary_folder.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

using closed_loop::ComparedModel;
using closed_loop::ComparedRun;
using closed_loop::Comparison;
using nlohmann::json;
using output::number;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw UsageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<ComparedModel> models_of(const HilOptions& options, const std::filesystem::path& sheet) {
  std::vector<ComparedModel> all;
  const auto take = [&](std::string label, const std::filesystem::path& path, std::string name) {
    all.push_back({std::move(label), std::move(name), load_model(path).model});
  };
  if (!options.base.empty() && options.model.empty())
    throw UsageError("--base is the model before an effect was added; name the one with it: --model MODEL");
  if (!options.base.empty()) take("base", options.base, options.base.string());
  if (!options.model.empty()) {
    take(options.base.empty() ? "model" : "added", options.model, options.model.string());
    return all;
  }
  take("base", sheet / "known-model.toml", "the manufacturer's values");
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
  output::Table table({"compensation", "rms error", "peak error", "unit", "ratio to none", "predicted", "95 % interval",
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

int run(const HilOptions& options, Console& console) {
  const closed_loop::Comparison comparison = run_closed_loop(options, console);
  output::save_json(options.json, closed_loop::to_json(comparison));
  return kDone;
}

void declare(Parser& parser, HilOptions& options) {
  parser.option("--scenario", options.scenario, "name or file; flexspline-hil scenarios lists names")
      .required()
      .value("S");
  parser
      .option("--model", options.model,
              "model for the feedforward (default: the manufacturer's values, hidden effect unknown)")
      .value("MODEL");
  parser.option("--base", options.base, "model before an effect was added, for one more run").value("MODEL");
  parser.option("--plant", options.plant, "plant file of the drive (default: the scenario's)").value("FILE");
  parser.option("--with", options.with, "effects that the drive has and the manufacturer's values include, A,B")
      .comma_separated()
      .value("EFFECT");
  parser.option("--hide", options.hide, "effect that the drive has and the manufacturer's values do not include")
      .value("EFFECT");
  parser
      .option("--settings", options.settings,
              "settings of the drive, as for pack --drive (default: the manufacturer's)")
      .value("FILE.toml");
  parser.option("--seconds", options.seconds, "duration of the motion (default: the scenario's)").value("S");
  parser.option("--processor", options.processor, "firmware image that runs the controller, in QEMU").value("ELF");
  parser.option("--draws", options.draws, "random parameter sets drawn for the predicted error; 0: no prediction")
      .shows_default()
      .value("N");
  parser.option("--seed", options.seed, "seed of the sensors' noise").shows_default().value("N");
  parser.option("--tick-hz", options.tick_hz, "ticks of the drive per second, a multiple of 1000")
      .shows_default()
      .value("HZ");
  parser.option("--picture", options.picture, "write the tracking errors as a picture into this file").value("SVG");
  parser.option("--report", options.report, "write a page with plots into this file").value("HTML");
}

}  // namespace

closed_loop::Comparison run_closed_loop(const HilOptions& options, Console& console) {
  if (options.seconds != 0.0 && options.seconds < 1.1)
    throw UsageError("--seconds has to be at least 1.1: the first second fades the motion in and is not scored");
  if (options.draws != 0 && (options.draws < 3 || options.draws > 200))
    throw UsageError("--draws has to be 0, or 3 to 200");
  require_report_place(options.report);
  closed_loop::ComparisonSetup setup;
  closed_loop::Job& job = setup.job;
  job.scenario = options.scenario;
  job.plant_file = options.plant.string();
  job.with = options.with;
  job.hide = options.hide;
  job.seconds = options.seconds;
  job.seed = options.seed;
  job.tick_hz = options.tick_hz;
  job.processor = options.processor.string();
  job.keeps_trace = !options.report.empty() || !options.picture.empty();
  const system::TemporaryFolder sheet;
  fetch_data_sheet(job, sheet.path());
  setup.models = models_of(options, sheet.path());
  const std::filesystem::path settings = options.settings.empty() ? sheet.path() / "settings.toml" : options.settings;
  setup.settings = text_of(settings);
  setup.settings_origin = settings.string();
  setup.draws = options.draws;
  const Comparison c =
      closed_loop::compare(std::move(setup), twin_runner(), [&](std::string_view stage) { console.progress(stage); });
  print(c, console);
  if (!options.report.empty()) {
    closed_loop::write_page(options.report, c);
    console.line(fmt::format("  {} shows this with plots; open it in a browser.", options.report.string()));
  }
  if (!options.picture.empty()) model::save(options.picture, closed_loop::picture(c));
  return c;
}

Command hil_command() {
  return command<HilOptions>(
      {"hil",
       "a drive in closed loop, with and without compensation",
       "Runs the drive's own firmware on a simulated drive along a motion, with the same loops each time: without "
       "compensation, with a model, and with the model that an effect was added to (--base and --model). Reports the "
       "tracking error of the output, the current, and limit cycles at rest; and what was predicted from the "
       "model and the uncertainty of its parameters alone. A scenario is a name (flexspline-hil scenarios lists "
       "them) or a file with motion, drive, surroundings and faults. Without --model the manufacturer's values are "
       "used. --processor runs the controller as the image of an ARM processor.",
       {"flexspline hil --scenario slow-reversals --hide stribeck_gaussian --seconds 4"}},
      declare, run);
}

}  // namespace flexspline::cli
