#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "host/app/cli/command.hpp"
#include "host/app/cli/command_flash.hpp"
#include "host/app/cli/command_hil.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/app/cli/twin_process.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

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
  return output::effect_label(named.effect, named.order);
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

// As the user says, else by chance.
std::string hidden_effect(const DemoOptions& options, std::uint64_t seed) {
  std::mt19937_64 chance(seed);
  std::string hidden = options.hidden;
  if (hidden.empty()) hidden = kMayHide[std::uniform_int_distribution<std::size_t>(0, std::size(kMayHide) - 1)(chance)];
  if (hidden == "none") return hidden;
  const std::string name = hidden.substr(0, hidden.find(':'));
  const bool known = std::any_of(std::begin(kMayHide), std::end(kMayHide),
                                 [&](std::string_view may) { return may.substr(0, may.find(':')) == name; });
  if (!known) {
    std::string list;
    for (const std::string_view may : kMayHide) list += fmt::format("{}{}", list.empty() ? "" : ", ", may);
    throw UsageError(fmt::format("\"{}\" cannot be hidden; choose one of {}, or none", hidden, list));
  }
  return hidden == "torque_ripple" ? "torque_ripple:2" : hidden;
}

void print_estimates(const estimation::Identification& identified, Console& console) {
  output::Table parameters({"parameter", "value", "95 % interval", "", "unit"}, "lrrrl");
  for (const auto& e : identified.estimates)
    parameters.row({fmt::format("{}.{}", e.id, e.parameter), number(e.value), number(e.low), number(e.high), e.unit});
  console.line(parameters.text());
}

void print_candidates(const selection::Diagnosis& found, Console& console) {
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
}

void print_missing(const selection::Diagnosis& found, Console& console) {
  std::vector<std::string> names;
  for (const auto& n : found.named) names.push_back(label(n));
  const auto& info = *catalogue::get(found.named.front().effect).info;
  console.line(console.bold(fmt::format("  Missing: {}", output::listed(names, "or"))));
  console.line(output::wrapped(info.explanation));
  console.line(output::wrapped(fmt::format("What it does: {}", info.consequence)));
  console.line(output::wrapped(fmt::format("Usual causes: {}", info.causes)));
  console.line(output::wrapped(fmt::format("Check on the machine: {}", info.check)));
  console.line();
}

void print_errors(const selection::Addition& added, Console& console) {
  if (!added.before.rmse_holdout || !added.after.rmse_holdout) return;
  output::Table table({added.signal, "error", "unit", "of noise"}, "lrlr");
  const auto row = [&](const char* what, double value) {
    table.row(
        {what, number(value), added.unit, added.noise_floor ? fmt::format("{:.2f}", value / *added.noise_floor) : "-"});
  };
  row("before", *added.before.rmse_holdout);
  row("after", *added.after.rmse_holdout);
  if (added.noise_floor) row("noise alone", *added.noise_floor);
  console.line(table.text());
}

// The steps in their order. Each prints what it found and keeps what the later ones need.
class Demo {
 public:
  Demo(const DemoOptions& options, Console& console)
      : options_(options),
        console_(console),
        seed_(options.seed ? *options.seed : std::random_device{}() % 100000),
        hidden_(hidden_effect(options, seed_)) {}

  void run() {
    make_folder(options_.out);
    record();
    identify();
    diagnose();
    if (found_.named.empty()) {
      console_.line(console_.bold("  Nothing is missing that these data could show."));
    } else {
      print_missing(found_, console_);
      add();
      put_on_drive();
    }
    write_report();
    reveal();
    output::save_json(options_.json, answer_);
  }

 private:
  void record() {
    console_.line(console_.bold("1. Record"));
    console_.progress("the twin records 16 experiments");
    std::vector<std::string> arguments{
        "record", "--force", "--out", recording_.string(), "--seed", std::to_string(seed_)};
    if (hidden_ != "none") arguments.insert(arguments.end(), {"--hide", hidden_});
    run_twin(arguments);
    DataInputs inputs;
    inputs.data = {recording_};
    dataset_ = load(inputs, console_);
    const auto unseen = std::count_if(dataset_.experiments.begin(), dataset_.experiments.end(),
                                      [](const auto& e) { return e.role == data::Role::holdout; });
    console_.line(output::wrapped(fmt::format(
        "A twin of a strain-wave drive (100:1, 40 N m) was moved through {} experiments, free and with its output "
        "locked; {} of them are held out for validation. It has an effect that the model does not know{}. Recording: "
        "{}",
        dataset_.experiments.size(), unseen, options_.hidden.empty() ? ", chosen by chance" : "",
        recording_.string())));
    console_.line();
  }

  void identify() {
    console_.line(console_.bold("2. Identify"));
    const model::ModelFile file = load_model(recording_ / "base-model.toml");
    console_.progress("identifying the model");
    base_ = estimation::identify(dataset_, file.model, {});
    stated_drive_ = file.model.drive;
    base_text_ = model::rewrite(file, with_stated_drive(base_->model));
    model::save(base_path_, base_text_);
    print_estimates(*base_, console_);
    console_.line(fmt::format("  Model: {}", base_path_.string()));
    console_.line();
  }

  void diagnose() {
    console_.line(console_.bold("3. Where does it fail, and what is missing?"));
    selection::Options how;
    how.progress = [&](std::string_view stage) { console_.progress(stage); };
    found_ = selection::diagnose(dataset_, base_->model, how);
    print_candidates(found_, console_);
    answer_ = {{"format", "flexspline-demo/1"},
               {"hidden", hidden_ == "none" ? json(nullptr) : json(hidden_)},
               {"seed", seed_},
               {"named", json::array()},
               {"verdict", selection::verdict_name(found_.verdict)},
               {"error_before", nullptr},
               {"error_after", nullptr},
               {"noise_floor", output::json_number(found_.noise_floor)},
               {"unit", found_.unit},
               {"report", nullptr},
               {"closed_loop", nullptr}};
    named_right_ = hidden_ == "none" && found_.named.empty();
    for (const auto& n : found_.named) {
      named_right_ = named_right_ || is_the_hidden_one(n, hidden_);
      answer_["named"].push_back({{"effect", n.effect}, {"order", n.order ? json(*n.order) : json(nullptr)}});
    }
    page_.command = "demo";
    page_.data_name = recording_.string();
    page_.model_name = base_path_.string();
    page_.dataset = &dataset_;
    page_.model = base_->model;
    page_.estimates = base_->estimates;
    page_.rounds = {found_};
  }

  void add() {
    console_.line(console_.bold("4. Add it, and compare on motions that the fit never saw"));
    console_.progress("adding the effect and refitting");
    const selection::Addition added = selection::add(dataset_, base_->model, label(found_.named.front()), {});
    const model::ModelFile base = model::parse(base_text_, base_path_.string(), catalogue::known_effects());
    model::save(better_path_, model::rewrite(base, with_stated_drive(added.model)));
    answer_["error_before"] = output::json_number(added.before.rmse_holdout);
    answer_["error_after"] = output::json_number(added.after.rmse_holdout);
    answer_["noise_floor"] = output::json_number(added.noise_floor);
    print_errors(added, console_);
    console_.progress("running both models on the unseen motions");
    print_free_runs(on_unseen(dataset_, base_->model), on_unseen(dataset_, added.model), console_);
    console_.line(fmt::format("  Model: {}", better_path_.string()));
    page_.model_name = better_path_.string();
    page_.before = std::exchange(page_.model, added.model);
    page_.estimates = added.estimates;
    page_.addition = added;
    console_.line();
  }

  // And a motion that was never recorded: without compensation, with the base model, with the added effect.
  void put_on_drive() {
    try {
      console_.line(console_.bold("5. Put it on the drive"));
      FlashOptions flash;
      flash.drive = "twin";
      flash.model = better_path_;
      flash.yes = true;
      cli::flash(flash, console_);
      console_.line();
      console_.line(
          console_.bold("6. A motion that was never recorded, in closed loop on the drive with its hidden effect"));
      HilOptions loop;
      loop.scenario = "slow-reversals";
      loop.model = better_path_;
      loop.base = base_path_;
      loop.hide = hidden_ == "none" ? "" : hidden_;
      loop.seed = seed_;
      loop.report = options_.out / "closed-loop.html";
      answer_["closed_loop"] = closed_loop::to_json(run_closed_loop(loop, console_));
    } catch (const std::runtime_error& error) {
      console_.warn(fmt::format("the model cannot be put on the drive: {}", error.what()));
    }
  }

  void write_report() {
    console_.progress("writing the report");
    report::write(report_, page_);
    answer_["report"] = report_.string();
    console_.line();
  }

  void reveal() {
    console_.line(console_.bold(found_.named.empty() ? "4. What the twin had hidden" : "7. What the twin had hidden"));
    if (hidden_ == "none")
      console_.line(fmt::format(
          "  Nothing. {}", named_right_ ? console_.good("Right.") : console_.bad("The name above is a false alarm.")));
    else
      console_.line(fmt::format("  {} (seed {}): {}. All true values: {}", hidden_, seed_,
                                named_right_ ? console_.good("named right") : console_.bad("named wrong"),
                                (recording_ / "truth.toml").string()));
    console_.line();
    console_.line(fmt::format("All of this with plots: {}, for a browser. With the mouse:", report_.string()));
    console_.line(fmt::format("  flexspline workbench --model {} {} --drive twin", quoted(base_path_.string()),
                              quoted(recording_.string())));
  }

  // Facts of the drive that only the data set has are not written into model files.
  model::Model with_stated_drive(model::Model model) const {
    model.drive = stated_drive_;
    return model;
  }

  const DemoOptions& options_;
  Console& console_;
  const std::uint64_t seed_;
  const std::string hidden_;
  const std::filesystem::path recording_ = options_.out / "recording";
  const std::filesystem::path base_path_ = options_.out / "model.toml";
  const std::filesystem::path better_path_ = options_.out / "model-with-effect.toml";
  const std::filesystem::path report_ = options_.out / "report.html";

  data::Dataset dataset_;
  model::Drive stated_drive_;
  std::string base_text_;
  std::unique_ptr<estimation::Identification> base_;
  selection::Diagnosis found_;
  bool named_right_ = false;
  report::Subject page_;
  json answer_;
};

int run(const DemoOptions& options, Console& console) {
  Demo(options, console).run();
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
