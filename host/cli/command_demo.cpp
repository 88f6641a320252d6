#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "host/cli/command.hpp"
#include "host/cli/command_flash.hpp"
#include "host/cli/command_hil.hpp"
#include "host/cli/common_options.hpp"
#include "host/cli/drive_commands.hpp"
#include "host/cli/report_option.hpp"
#include "host/cli/twin_process.hpp"
#include "host/comparison/compare.hpp"
#include "host/estimation/identify.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"
#include "host/selection/add.hpp"
#include "host/selection/diagnosis.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using output::number;

struct DemoOptions {
  std::string hidden;  // empty: by chance; "none": nothing
  std::optional<std::uint64_t> seed;
  std::filesystem::path out = "demo-out";
  std::string json;
};

// What the demo may hide: effects that a strain-wave drive may have and a first model lacks.
constexpr std::string_view kMayHide[] = {
    "viscous_asymmetry", "coulomb_asymmetry", "stribeck_gaussian", "load_dependent_friction", "power_law_friction",
    "gravity",           "current_offset",    "torque_ripple:2",   "torque_ripple:7",         "temperature_viscous",
    "dahl_friction",     "backlash",          "structural_damping"};

std::string label(const selection::NamedEffect& named) {
  return named.order ? fmt::format("{}:{:g}", named.effect, *named.order) : named.effect;
}

// The same effect, whether or not an order was given with it.
bool is_the_hidden_one(const selection::NamedEffect& named, const std::string& hidden) {
  return label(named) == hidden || (named.effect == "torque_ripple" && hidden == "torque_ripple" && named.order == 2.0);
}

// Free run on motions that the fit never saw: nothing of the measurement but the effort goes in.
comparison::Comparison on_unseen(const data::Dataset& dataset, const model::Model& model) {
  data::Dataset unseen;
  unseen.drive = dataset.drive;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::holdout) unseen.experiments.push_back(e);
  return comparison::compare(unseen, model, {});
}

// In free motion the velocity is compared; in locked load the current dictates the torque, and the angle shows the
// errors.
void print_free_runs(const comparison::Comparison& before, const comparison::Comparison& after, Console& console) {
  output::Table table({"free run, current alone goes in", "signal", "error before", "after", "unit"}, "llrrl");
  bool worse = false;
  for (std::size_t i = 0; i < after.experiments.size(); ++i) {
    const auto& signals = after.experiments[i].signals;
    const bool locked =
        std::none_of(signals.begin(), signals.end(), [](const auto& s) { return s.signal == "output_position"; });
    const std::string_view wanted = locked ? "motor_position" : "motor_velocity";
    const auto a = std::find_if(signals.begin(), signals.end(), [&](const auto& s) { return s.signal == wanted; });
    if (a == signals.end()) continue;
    for (const comparison::SignalResult& b : before.experiments[i].signals) {
      if (b.signal != wanted) continue;
      table.row({after.experiments[i].name, std::string(wanted), number(b.rmse), number(a->rmse), a->unit});
      worse = worse || a->rmse > 1.2 * b.rmse;
    }
  }
  if (!table.empty()) console.line(table.text());
  if (worse)
    console.line(
        output::wrapped("A free run has no feedback. Where friction falls with speed, slow motion under a given "
                        "current is unstable: the smallest difference grows, and no model follows it for long."));
}

// On the drive, and a motion that was never recorded: without compensation, with the base model, with the added effect.
json close_the_loop(const std::filesystem::path& folder, const std::filesystem::path& base,
                    const std::filesystem::path& better, const std::string& hidden, std::uint64_t seed,
                    Console& console) {
  console.line(console.bold("5. Put it on the drive"));
  FlashOptions flash;
  flash.drive = "twin";
  flash.model = better;
  flash.yes = true;
  cli::flash(flash, console);
  console.line();
  console.line(console.bold("6. A motion that was never recorded, in closed loop on the drive with its hidden effect"));
  HilOptions loop;
  loop.scenario = "slow-reversals";
  loop.model = better;
  loop.base = base;
  loop.hide = hidden == "none" ? "" : hidden;
  loop.seed = seed;
  loop.report = folder / "closed-loop.html";
  return closed_loop::to_json(run_closed_loop(loop, console));
}

int run(const DemoOptions& options, Console& console) {
  std::uint64_t seed = options.seed.value_or(0);
  if (!options.seed) seed = std::random_device{}() % 100000;
  std::mt19937_64 chance(seed);
  std::string hidden = options.hidden;
  if (hidden.empty()) hidden = kMayHide[std::uniform_int_distribution<std::size_t>(0, std::size(kMayHide) - 1)(chance)];
  if (hidden != "none") {
    const std::string name = hidden.substr(0, hidden.find(':'));
    const bool known = std::any_of(std::begin(kMayHide), std::end(kMayHide),
                                   [&](std::string_view may) { return may.substr(0, may.find(':')) == name; });
    if (!known) {
      std::string list;
      for (const std::string_view may : kMayHide) list += fmt::format("{}{}", list.empty() ? "" : ", ", may);
      throw UsageError(fmt::format("\"{}\" cannot be hidden; choose one of {}, or none", hidden, list));
    }
    if (hidden == "torque_ripple") hidden = "torque_ripple:2";
  }

  const std::filesystem::path folder = options.out;
  make_folder(folder);
  const std::filesystem::path recording = folder / "recording";
  console.line(console.bold("1. Record"));
  console.progress("the twin records 16 experiments");
  std::vector<std::string> arguments{"record", "--force", "--out", recording.string(), "--seed", std::to_string(seed)};
  if (hidden != "none") arguments.insert(arguments.end(), {"--hide", hidden});
  run_twin(arguments);
  DataInputs inputs;
  inputs.data = {recording};
  const data::Dataset dataset = load(inputs, console);
  const auto unseen = std::count_if(dataset.experiments.begin(), dataset.experiments.end(),
                                    [](const auto& e) { return e.role == data::Role::holdout; });
  console.line(output::wrapped(fmt::format(
      "A twin of a strain-wave drive (100:1, 40 N m) was moved through {} experiments, free and with its output "
      "locked; {} of them are held out for validation. It has an effect that the model does not know{}. Recording: {}",
      dataset.experiments.size(), unseen, options.hidden.empty() ? ", chosen by chance" : "", recording.string())));
  console.line();

  console.line(console.bold("2. Identify"));
  const model::ModelFile base_file = load_model(recording / "base-model.toml");
  console.progress("identifying the model");
  const auto base = estimation::identify(dataset, base_file.model, {});
  const std::filesystem::path base_path = folder / "model.toml";
  model::Model stored = base->model;
  stored.drive = base_file.model.drive;
  const std::string base_text = model::rewrite(base_file, stored);
  model::save(base_path, base_text);
  output::Table parameters({"parameter", "value", "95 % interval", "", "unit"}, "lrrrl");
  for (const auto& e : base->estimates)
    parameters.row({fmt::format("{}.{}", e.id, e.parameter), number(e.value), number(e.low), number(e.high), e.unit});
  console.line(parameters.text());
  console.line(fmt::format("  Model: {}", base_path.string()));
  console.line();

  console.line(console.bold("3. Where does it fail, and what is missing?"));
  selection::Options diagnose_options;
  diagnose_options.progress = [&](std::string_view stage) { console.progress(stage); };
  const selection::Diagnosis found = selection::diagnose(dataset, base->model, diagnose_options);
  if (found.noise_floor)
    console.line(output::wrapped(fmt::format("The {} is off by {}, {:.1f} times what noise alone would leave.",
                                             found.balance ? selection::balance_signal(*found.balance) : "model",
                                             output::with_unit(found.base_rmse, found.unit),
                                             found.base_rmse / *found.noise_floor)));
  for (std::size_t i = 0; i < std::min<std::size_t>(2, found.localised.size()); ++i)
    console.line(output::wrapped(fmt::format("{:.0f} % of the error depends on {}.", found.localised[i].share_percent,
                                             found.localised[i].variable)));
  output::Table ranked({"candidate", "score", "error decreases by", "on"}, "lrrl");
  for (std::size_t i = 0; i < std::min<std::size_t>(4, found.candidates.size()); ++i) {
    const auto& c = found.candidates[i];
    ranked.row({label({c.effect, c.order}), fmt::format("{:.0f}", c.score),
                fmt::format("{:.1f} %", 100.0 * (1.0 - c.rmse_cv_after / c.rmse_cv_before)),
                std::string(selection::balance_signal(c.balance))});
  }
  console.line(ranked.text());
  console.line();

  json answer = {{"format", "flexspline-demo/1"},
                 {"hidden", hidden == "none" ? json(nullptr) : json(hidden)},
                 {"seed", seed},
                 {"named", json::array()},
                 {"verdict", selection::verdict_name(found.verdict)},
                 {"error_before", nullptr},
                 {"error_after", nullptr},
                 {"noise_floor", output::json_number(found.noise_floor)},
                 {"unit", found.unit},
                 {"report", nullptr},
                 {"closed_loop", nullptr}};
  bool right = hidden == "none" && found.named.empty();
  report::Subject page;
  page.command = "demo";
  page.data_name = recording.string();
  page.model_name = base_path.string();
  page.dataset = &dataset;
  page.model = base->model;
  page.estimates = base->estimates;
  page.rounds = {found};
  if (found.named.empty()) {
    console.line(console.bold("  Nothing is missing that these data could show."));
  } else {
    std::vector<std::string> names;
    for (const auto& n : found.named) {
      names.push_back(label(n));
      right = right || is_the_hidden_one(n, hidden);
      answer["named"].push_back({{"effect", n.effect}, {"order", n.order ? json(*n.order) : json(nullptr)}});
    }
    const auto& info = *catalogue::get(found.named.front().effect).info;
    console.line(console.bold(fmt::format("  Missing: {}", output::listed(names, "or"))));
    console.line(output::wrapped(info.explanation));
    console.line(output::wrapped(fmt::format("What it does: {}", info.consequence)));
    console.line(output::wrapped(fmt::format("Usual causes: {}", info.causes)));
    console.line(output::wrapped(fmt::format("Check on the machine: {}", info.check)));
    console.line();

    console.line(console.bold("4. Add it, and compare on motions that the fit never saw"));
    console.progress("adding the effect and refitting");
    const selection::Addition added = selection::add(dataset, base->model, names.front(), {});
    const std::filesystem::path path = folder / "model-with-effect.toml";
    model::Model better = added.model;
    better.drive = base_file.model.drive;
    model::save(path, model::rewrite(model::parse(base_text, base_path.string(), catalogue::known_effects()), better));
    answer["error_before"] = output::json_number(added.before.rmse_holdout);
    answer["error_after"] = output::json_number(added.after.rmse_holdout);
    answer["noise_floor"] = output::json_number(added.noise_floor);
    if (added.before.rmse_holdout && added.after.rmse_holdout) {
      output::Table table({added.signal, "error", "unit", "of noise"}, "lrlr");
      const auto row = [&](const char* what, double value) {
        table.row({what, number(value), added.unit,
                   added.noise_floor ? fmt::format("{:.2f}", value / *added.noise_floor) : "-"});
      };
      row("before", *added.before.rmse_holdout);
      row("after", *added.after.rmse_holdout);
      if (added.noise_floor) row("noise alone", *added.noise_floor);
      console.line(table.text());
    }
    console.progress("running both models on the unseen motions");
    print_free_runs(on_unseen(dataset, base->model), on_unseen(dataset, added.model), console);
    console.line(fmt::format("  Model: {}", path.string()));
    page.model_name = path.string();
    page.before = std::exchange(page.model, added.model);
    page.estimates = added.estimates;
    page.addition = added;
    console.line();
    try {
      answer["closed_loop"] = close_the_loop(folder, base_path, path, hidden, seed, console);
    } catch (const std::runtime_error& error) {
      console.warn(fmt::format("the model cannot be put on the drive: {}", error.what()));
    }
  }
  const std::filesystem::path report = folder / "report.html";
  console.progress("writing the report");
  report::write(report, page);
  answer["report"] = report.string();
  console.line();
  console.line(console.bold(found.named.empty() ? "4. What the twin had hidden" : "7. What the twin had hidden"));
  if (hidden == "none")
    console.line(
        fmt::format("  Nothing. {}", right ? console.good("Right.") : console.bad("The name above is a false alarm.")));
  else
    console.line(fmt::format("  {} (seed {}): {}. All true values: {}", hidden, seed,
                             right ? console.good("named right") : console.bad("named wrong"),
                             (recording / "truth.toml").string()));
  console.line();
  console.line(fmt::format("All of this with plots: {}, for a browser. With the mouse:", report.string()));
  console.line(fmt::format("  flexspline workbench --model {} {} --drive twin", quoted(base_path.string()),
                           quoted(recording.string())));
  output::save_json(options.json, answer);
  return kDone;
}

void declare(Parser& parser, DemoOptions& options) {
  parser.option("--hidden", options.hidden, "effect that the twin hides, or none (default: by chance)").value("EFFECT");
  parser.option("--seed", options.seed, "of the random numbers (default: another one each time)").value("N");
  parser.option("--out", options.out, "folder for recording and models (default: demo-out)").value("DIR");
}

}  // namespace

Command demo_command() {
  return command<DemoOptions>(
      {"demo",
       "all steps on the embedded twin, with a hidden effect",
       "A simulated drive with one effect that the model does not know is recorded, identified and compared; "
       "the missing effect is diagnosed and added, and both models are compared on motions that the fit "
       "never saw. At the end the twin states what was hidden. report.html shows all of it with plots.",
       {"flexspline demo --hidden stribeck_gaussian --seed 7 --out demo-out"}},
      declare, run);
}

}  // namespace flexspline::cli
