#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/report_option.hpp"
#include "host/diagnosis/add.hpp"
#include "host/diagnosis/diagnosis.hpp"
#include "host/output/diagnosis.hpp"
#include "host/output/json.hpp"

namespace flexspline::cli {
namespace {

// An error that no addition ends is not searched for ever.
constexpr std::size_t kMostRounds = 8;

std::string add_command(const DiagnoseOptions& options) {
  std::string text = fmt::format("flexspline add EFFECT --model {} {}", quoted(options.model.string()),
                                 as_arguments(options.data.data));
  if (!options.data.holdout.empty()) text += fmt::format(" --holdout {}", as_arguments(options.data.holdout));
  std::filesystem::path out = options.model;
  out.replace_filename(options.model.stem().string() + "-more.toml");
  return text + fmt::format(" --out {}", quoted(out.string()));
}

// The model of the last round with values, beside the one that was asked about where effects were added.
void write_page(const DiagnoseOptions& options, const data::Dataset& dataset, const model::Model& asked,
                const model::Model& last, const std::vector<diagnosis::Diagnosis>& rounds, Console& console) {
  if (options.report.empty()) return;
  console.progress("fitting the model for the report");
  const regression::PipelineOptions pipeline = options.pipeline.options();
  const auto fitted = regression::identify(dataset, last, pipeline);
  report::Subject subject{.command = "diagnose",
                          .data_name = as_arguments(options.data.data),
                          .model_name = options.model.string(),
                          .dataset = &dataset,
                          .model = fitted->model,
                          .pipeline = pipeline,
                          .estimates = fitted->estimates,
                          .rounds = rounds};
  if (rounds.size() > 1) subject.before = regression::identify(dataset, asked, pipeline)->model;
  write_report(options.report, subject, console);
}

}  // namespace

int run(const DiagnoseOptions& options, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_model(options.model);
  const data::Dataset dataset = load(options.data, console);
  diagnosis::Options how;
  how.pipeline = options.pipeline.options();
  how.progress = [&](std::string_view stage) { console.progress(stage); };
  model::Model model = file.model;
  std::vector<diagnosis::Diagnosis> rounds;
  for (;;) {
    rounds.push_back(diagnosis::diagnose(dataset, model, how));
    const diagnosis::Diagnosis& found = rounds.back();
    for (const std::string& warning : found.warnings) console.warn(warning);
    if (options.all) {
      console.line();
      console.line(console.bold(fmt::format("Round {}", rounds.size())));
    }
    output::print_diagnosis(console, found, add_command(options));
    if (!options.all || found.verdict != diagnosis::Verdict::missing_effect || found.named.empty() ||
        rounds.size() == kMostRounds)
      break;
    console.progress("adding it");
    model = diagnosis::add(dataset, model, output::effect_label(found.named.front().effect, found.named.front().order),
                           how.pipeline)
                .model;
  }
  write_page(options, dataset, file.model, model, rounds, console);
  output::save_json(options.json, options.all ? output::rounds_json(rounds) : output::diagnosis_json(rounds.front()));
  return kDone;
}

}  // namespace flexspline::cli
