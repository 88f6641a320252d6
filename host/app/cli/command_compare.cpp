#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/output/answers/comparison.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

struct CompareOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::vector<std::string> limits;     // SIGNAL=RMSE
  std::vector<std::string> baselines;  // fir:20, arx:4,4,1
  std::filesystem::path report;        // empty: none
  std::string json;
};

constexpr std::string_view kSignals[] = {"motor_balance",  "transmission_balance", "load_balance", "motor_velocity",
                                         "motor_position", "output_position",      "torque"};

struct Limit {
  std::string signal;
  double rmse = 0.0;
};

Limit parse_limit(const std::string& text) {
  const std::size_t equals = text.find('=');
  Limit limit{text.substr(0, equals), 0.0};
  bool known = false;
  for (const std::string_view signal : kSignals) known |= signal == limit.signal;
  const std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
  const auto [stop, error] = std::from_chars(value.data(), value.data() + value.size(), limit.rmse);
  if (!known || error != std::errc{} || stop != value.data() + value.size() || !(limit.rmse >= 0.0))
    throw UsageError(
        fmt::format("--limit {} is not SIGNAL=RMSE with a number in the signal's SI unit; signals are {}, as in "
                    "--limit motor_balance=0.02",
                    text, output::listed({std::begin(kSignals), std::end(kSignals)}, "and")));
  return limit;
}

bool is_kept(const Limit& limit, const comparison::Comparison& comparison, Console& console) {
  for (const comparison::SignalResult& s : comparison.overall) {
    if (s.signal != limit.signal) continue;
    const bool kept = s.rmse <= limit.rmse;
    console.line(fmt::format("{}: rmse {} is {} the limit of {}: {}", s.signal, output::with_unit(s.rmse, s.unit),
                             kept ? "within" : "above", output::with_unit(limit.rmse, s.unit),
                             kept ? console.good("met") : console.bad("not met")));
    if (!kept)
      console.error(fmt::format("the limit {}={:g} is not met: rmse {}", limit.signal, limit.rmse,
                                output::with_unit(s.rmse, s.unit)));
    return kept;
  }
  throw UsageError(
      fmt::format("--limit {}: these data and this model do not give that signal; flexspline check reports "
                  "which columns are missing",
                  limit.signal));
}

int run(const CompareOptions& options, Console& console) {
  std::vector<Limit> limits;
  for (const std::string& text : options.limits) limits.push_back(parse_limit(text));
  std::vector<blackbox::Specification> baselines;
  try {
    for (const std::string& text : options.baselines) baselines.push_back(blackbox::parse_specification(text));
  } catch (const std::invalid_argument& wrong) {
    throw UsageError(fmt::format("--baseline {}", wrong.what()));
  }
  require_report_place(options.report);
  const model::ModelFile file = load_model(options.model);
  const data::Dataset dataset = load(options.data, console);
  console.progress("comparing model and measurement");
  const comparison::Comparison comparison =
      comparison::compare(dataset, file.model, options.pipeline.options(), baselines);
  for (const std::string& warning : comparison.warnings) console.warn(output::words_on(file.model.drive.axis, warning));
  console.line(output::comparison_table(comparison));
  if (!options.report.empty())
    write_report(options.report,
                 {.command = "compare",
                  .data_name = as_arguments(options.data.data),
                  .model_name = options.model.string(),
                  .dataset = &dataset,
                  .model = file.model,
                  .pipeline = options.pipeline.options(),
                  .baselines = baselines},
                 console);
  output::save_json(options.json, output::comparison_json(comparison));
  bool all_kept = true;
  for (const Limit& limit : limits) all_kept = is_kept(limit, comparison, console) && all_kept;
  return all_kept ? kDone : kNotMet;
}

void declare(Parser& parser, CompareOptions& options) {
  take_data(parser, options.data);
  take_model(parser, options.model);
  take_holdout(parser, options.data);
  parser.option("--limit", options.limits, "exit code 1 if a signal's error is above this; may be repeated")
      .value("SIGNAL=RMSE")
      .one_value_each_time();
  parser
      .option("--baseline,--beside", options.baselines,
              "fit a black box as a baseline: fir:N, arx:NA,NB,NK, or fir:auto, arx:auto; may be repeated")
      .value("BOX")
      .one_value_each_time();
  take_report(parser, options.report);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command compare_command() {
  return command<CompareOptions>(
      {"compare",
       "model against measurement, by experiment, signal and region",
       "Compares in both directions: the torque (on a linear axis the force) that the model needs for the measured "
       "motion (the balances), and the "
       "motion that it predicts from the motor's current or torque alone (free run). Errors are shown with the noise "
       "of the "
       "measurement where that is known; experiments are in the order of DATA, files of a folder by name; the regions "
       "with the largest excess over it are named. --limit sets a "
       "limit: exit code 1 where a signal's error is above it. --baseline fits a linear black box (FIR or ARX) to the "
       "same signals, on the experiments that are not held out, and shows what error its many parameters reach. "
       "--report writes a page with plots of all of it.",
       {kMakeData, kIdentify, "flexspline compare --model fitted.toml demo-out --baseline arx:4,4,1"}},
      declare, run);
}

}  // namespace flexspline::cli
