#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/engine/planning/design.hpp"
#include "host/engine/selection/add.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/plan.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::cli {
namespace {

struct PlanOptions {
  DataInputs data;  // may be none
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;
  std::vector<std::string> separate;  // two effects, or none
  std::vector<std::string> with;      // of kAbilities: what the data do not show
  std::vector<std::string> without;   // of kAbilities
  std::vector<double> temperatures_c;
  std::optional<double> current_a, velocity_rad_s, travel_rad, duration_s, load_torque_nm, run_s, sample_hz;
  int motions = 4;
  std::string json;
};

const std::vector<std::string> kAbilities = {"off", "free", "locked", "load", "temperature"};

bool is_in(const std::vector<std::string>& list, std::string_view name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

void take_abilities(const PlanOptions& options, planning::MotionSettings& setting) {
  bool* const abilities[] = {&setting.off, &setting.free, &setting.locked, &setting.external_load,
                             &setting.temperature};
  for (std::size_t i = 0; i < kAbilities.size(); ++i) {
    const bool can = is_in(options.with, kAbilities[i]), cannot = is_in(options.without, kAbilities[i]);
    if (can && cannot)
      throw UsageError(
          fmt::format("--with {0} and --without {0} contradict each other; give one of them", kAbilities[i]));
    if (can || cannot) *abilities[i] = can;
  }
}

void require_limits(const planning::Limits& limits, data::Axis axis) {
  if (!(limits.current_a > 0.0))
    throw UsageError("the largest current is not known; state rated_current_a in the model's [drive], or --current-a");
  if (!(limits.velocity_rad_s > 0.0))
    throw UsageError(
        fmt::format("the largest velocity is not known; state rated_velocity_rad_s in the model's [drive], or "
                    "--velocity-rad-s{}",
                    axis == data::Axis::linear ? ", in m/s" : ""));
  if (!(limits.travel_rad > 0.0)) throw UsageError("the travel of the axis is not known; give --travel-rad, in m");
}

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
  take_abilities(options, setting);
  require_limits(limits, model.drive.axis);
  return setting;
}

bool asks_for_temperatures(const PlanOptions& options) {
  return !options.temperatures_c.empty() || is_in(options.with, "temperature");
}

// Why two temperatures are not proposed; empty where they may be, or where nobody expects them.
std::string why_no_temperatures(const PlanOptions& options, const model::Model& model, const data::Dataset* dataset) {
  const auto reads = [](const catalogue::Entry& entry) { return (entry.info->reads & effects::kTemperature) != 0; };
  const bool depends = std::any_of(model.effects.begin(), model.effects.end(),
                                   [&](const model::Effect& effect) { return reads(catalogue::entry_of(effect)); }) ||
                       std::any_of(options.separate.begin(), options.separate.end(), [&](const std::string& name) {
                         return reads(*selection::parse_effect(name).entry);
                       });
  const bool asked = asks_for_temperatures(options);
  if (asked && !depends)
    return "No effect of the model depends on the temperature: recordings at two temperatures are not proposed.";
  if (depends && !asked && dataset && !dataset->has(data::Column::temperature) &&
      !is_in(options.without, "temperature"))
    return "The data have no temperature_c: recordings at two temperatures are not proposed. Where one can be "
           "measured, "
           "give --temperatures COLD,WARM.";
  return {};
}

// What the plan takes for possible, or for impossible, that neither data nor options state.
std::vector<std::string> assumptions(const PlanOptions& options, const planning::MotionSettings& setting,
                                     const model::Model& model, const data::Dataset* dataset,
                                     const planning::Design& design) {
  const auto any_run = [&](auto has) { return std::any_of(design.plan.runs.begin(), design.plan.runs.end(), has); };
  const auto any_record = [&](auto has) {
    return dataset && std::any_of(dataset->experiments.begin(), dataset->experiments.end(), has);
  };
  std::vector<std::string> unknown;
  const auto assume = [&](const char* ability, const char* what, bool planned, bool shown) {
    if (planned && !shown && !is_in(options.with, ability))
      unknown.push_back(fmt::format("{} (--without {})", what, ability));
  };
  assume("free", "the output can move",
         any_run([](const auto& r) { return !r.locked && r.mode != planning::Mode::off; }), dataset != nullptr);
  assume("locked", "the output can be locked", any_run([](const auto& r) { return r.locked; }),
         any_record([](const data::Experiment& e) { return e.load == data::Load::locked; }));
  assume("load", "a constant load can act on the output",
         any_run([](const auto& r) { return r.load_torque_nm != 0.0; }),
         options.load_torque_nm.has_value() ||
             any_record([](const data::Experiment& e) { return e.has(data::Column::load_torque); }));
  assume("temperature", "the drive can be recorded cold and warm",
         any_run([](const auto& r) { return r.temperature_c.has_value(); }),
         dataset != nullptr || !options.temperatures_c.empty());
  std::vector<std::string> notes;
  if (!unknown.empty())
    notes.push_back(fmt::format("Assumed, as neither data nor options state it: {}.", output::listed(unknown)));
  if (!setting.free && !is_in(options.without, "free"))
    notes.emplace_back(
        "All recordings have a locked output: motions of a free output are not proposed. Where it can move, give "
        "--with free.");
  if (std::string why = why_no_temperatures(options, model, dataset); !why.empty()) notes.push_back(std::move(why));
  if (design.plan.runs.empty()) return notes;
  if (!design.effort_is_current)
    notes.push_back(output::words_on(
        design.axis,
        "The data have a torque and no torque constant is known: amplitudes and limits of currents are in N m here. "
        "State torque_constant_nm_a in the model's [drive] to have them in A."));
  else if (!dataset && !model.drive.torque_constant_nm_a.value)
    notes.push_back(output::words_on(design.axis,
                                     "No torque constant is known: 1 A is taken for 1 N m. State torque_constant_nm_a "
                                     "in the model's [drive]."));
  return notes;
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

int run(const PlanOptions& options, Console& console) {
  if (!options.separate.empty() && options.separate[0] == options.separate[1])
    throw UsageError(fmt::format("--separate: both effects are {}; name two", options.separate[0]));
  const model::ModelFile file = load_searched_model(options.model);
  std::optional<data::Dataset> dataset;
  if (!options.data.data.empty()) dataset = load(options.data, console);
  planning::PlanRequest request;
  request.model = &file.model;
  request.dataset = dataset ? &*dataset : nullptr;
  request.pipeline = options.pipeline.options();
  request.setting = setting_of(options, file.model, request.dataset);
  request.sensors = planning::sensors_of(file.model, request.dataset);
  // Who records at two temperatures measures them.
  request.sensors.temperature = request.sensors.temperature || asks_for_temperatures(options);
  request.sample_s = sample_time(options, dataset ? &*dataset : nullptr, request.setting.run_s, console);
  request.most_motions = static_cast<std::size_t>(options.motions);
  request.progress = [&](std::string_view stage) { console.progress(stage); };
  planning::Design design = options.separate.empty()
                                ? planning::d_optimal(request)
                                : planning::discriminate(request, options.separate[0], options.separate[1]);
  for (const std::string& warning : design.warnings) console.warn(warning);
  for (std::string& note : assumptions(options, request.setting, file.model, request.dataset, design))
    design.plan.notes.push_back(std::move(note));
  model::save(options.out, planning::text_of(design.plan));
  output::print_plan(console, design, options.out.string());
  output::save_json(options.json, output::plan_json(design));
  return kDone;
}

void declare(Parser& parser, PlanOptions& options) {
  parser.option("DATA", options.data.data, fmt::format("what there is already: {}", kDataHelp)).value("");
  take_tolerate(parser, options.data.tolerate);
  take_model(parser, options.model);
  parser.option("--out", options.out, "the plan").required().value("PLAN");
  parser
      .option("--separate", options.separate,
              "two effects to distinguish (default: a plan that determines all parameters)")
      .comma_separated()
      .number_of_values(2)
      .value("A,B");
  const auto limit = [&parser](const char* name, std::optional<double>& value, const char* help, const char* unit) {
    parser.option(name, value, help).positive().value(unit);
  };
  limit("--current-a", options.current_a,
        "largest motor current (default: the model's rated one, else that of DATA); where DATA have a torque and no "
        "torque constant is known, the largest torque",
        "A");
  limit("--velocity-rad-s", options.velocity_rad_s,
        "largest motor velocity (default: the model's rated one, else that of DATA)", "RAD/S");
  limit("--travel-rad", options.travel_rad,
        "travel of the output from end to end (default: one turn, on a linear axis that of DATA)", "RAD");
  limit("--duration-s", options.duration_s, "of all recordings together (default: 180)", "S");
  limit("--load-torque-nm", options.load_torque_nm,
        "constant torque that you can apply to the output (default: what half of the current holds)", "NM");
  limit("--run-s", options.run_s, "of one recording (default: 8)", "S");
  limit("--sample-hz", options.sample_hz, "rate of the recording (default: that of DATA, else 1000)", "HZ");
  parser
      .option("--without", options.without,
              "what you cannot do: off (switch the drive off), free (let the output move), locked (lock it), load, "
              "temperature")
      .comma_separated()
      .one_of(kAbilities)
      .value("WHAT");
  parser.option("--with", options.with, "of these, what you can do although DATA do not show it")
      .comma_separated()
      .one_of(kAbilities)
      .value("WHAT");
  parser.option("--temperatures", options.temperatures_c, "housing cold and warm, degC (default: 25,40)")
      .comma_separated()
      .number_of_values(2)
      .value("COLD,WARM");
  parser.option("--motions", options.motions, "at most so many").within(1, 20).shows_default().value("N");
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command plan_command() {
  return command<PlanOptions>(
      {"plan",
       "designs the motion that distinguishes two effects, or that determines the parameters",
       "Rehearses some thirty motions with the model, within the limits of the drive: triangles slow and fast, sines, "
       "saw-teeth, multisines, chirps, steps of speed, a locked output, a constant load, two temperatures, the "
       "drive off. With --separate, motions are chosen that distinguish two effects best: by the part of one "
       "effect's torque that the model with the other cannot reproduce, over the noise. Without it, motions that "
       "determine all parameters best. Measurements, where given, give the noise, the sizes of the effects and what "
       "need not be recorded again, and what the drive can do: where all of them have a locked output, or no "
       "temperature, other recordings are proposed with --with only. What is assumed is printed. On a linear axis the "
       "limits are in m, m/s and N. If no motion distinguishes two effects, the answer says so. The plan is a TOML "
       "file that flexspline record --plan runs on a drive or the twin.",
       {kMakeData, kIdentify,
        "flexspline plan --separate stribeck_gaussian,load_dependent_friction --model fitted.toml --out "
        "plan.toml"}},
      declare, run);
}

}  // namespace flexspline::cli
