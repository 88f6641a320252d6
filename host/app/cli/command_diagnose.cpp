#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/engine/selection/add_until_complete.hpp"
#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

struct DiagnoseOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  bool all = false;              // --auto
  std::filesystem::path report;  // empty: none
  std::string json;
};

// An error that no addition ends is not searched for ever.
constexpr std::size_t kMostRounds = 8;

std::string add_command(const DiagnoseOptions& options) {
  const std::string text = fmt::format("flexspline add EFFECT --model {} {}", quoted(options.model.string()),
                                       as_arguments(options.data, options.pipeline));
  std::filesystem::path out = options.model;
  out.replace_filename(options.model.stem().string() + "-more.toml");
  return text + fmt::format(" --out {}", quoted(out.string()));
}

// The model of the last round with values; and the user's own model where effects were added.
void write_page(const DiagnoseOptions& options, const data::Dataset& dataset, const model::Model& given,
                const model::Model& last, const std::vector<selection::Diagnosis>& rounds, Console& console) {
  if (options.report.empty()) return;
  console.progress("fitting the model for the report");
  const estimation::PipelineOptions pipeline = options.pipeline.options();
  const auto fitted = estimation::identify(dataset, last, pipeline);
  report::Subject subject{.command = "diagnose",
                          .data_name = as_arguments(options.data.data),
                          .model_name = options.model.string(),
                          .dataset = &dataset,
                          .model = fitted->model,
                          .pipeline = pipeline,
                          .estimates = fitted->estimates,
                          .rounds = rounds};
  if (rounds.size() > 1) subject.before = estimation::identify(dataset, given, pipeline)->model;
  write_report(options.report, subject, console);
}

int run(const DiagnoseOptions& options, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_searched_model(options.model);
  const data::Dataset dataset = load(options.data, console);
  selection::Options how;
  how.pipeline = options.pipeline.options();
  how.progress = [&](std::string_view stage) { console.progress(stage); };
  std::size_t round = 0;
  const auto print = [&](const selection::Diagnosis& found) {
    for (const std::string& warning : found.warnings) console.warn(output::words_on(file.model.drive.axis, warning));
    if (options.all) {
      console.line();
      console.line(console.bold(fmt::format("Round {}", ++round)));
    }
    output::print_diagnosis(console, found, add_command(options), &file.model.drive, &dataset);
  };
  const selection::StepwiseSelection done =
      selection::add_until_complete(dataset, file.model, how, options.all ? kMostRounds : 1, print);
  for (const std::string& effect : done.removed)
    console.line(fmt::format(
        "{} was removed: with the other effects in the model it no longer reduces the error significantly.", effect));
  write_page(options, dataset, file.model, done.model, done.rounds, console);
  output::save_json(options.json, options.all ? output::rounds_json(done.rounds, done.kept)
                                              : output::diagnosis_json(done.rounds.front()));
  return kDone;
}

void declare(Parser& parser, DiagnoseOptions& options) {
  take_data(parser, options.data);
  take_model(parser, options.model);
  take_holdout(parser, options.data);
  parser.flag("--auto", options.all, "continue with the named effect added, until no more is found");
  take_report(parser, options.report);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command diagnose_command() {
  return command<DiagnoseOptions>(
      {"diagnose",
       "which physical effect is missing from a model, or that none is",
       "Fits the model, finds where its error is large, tries every effect of the catalogue against data left out of "
       "the fit, and names the one that is missing; or reports that none is, or that these data cannot show it, and "
       "which experiment would. The model needs no values. With --auto it continues with the effect added until "
       "nothing more is found. --report writes a page with plots: where the model fails, and what is missing. The "
       "verdict "
       "is made at the cut-off and the mask that the data give; where --cutoff-hz or --mask state others, the answer "
       "says what these alone would name.",
       {kMakeData, "flexspline diagnose --model demo-out/base-model.toml demo-out"}},
      declare, run);
}

}  // namespace flexspline::cli
