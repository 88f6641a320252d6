#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/report_option.hpp"
#include "host/output/identification.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"
#include "host/regression/identify.hpp"

namespace flexspline::cli {
namespace {

bool has_free_shapes(const model::Model& model) {
  for (const regression::Term& term : regression::terms_of(model))
    for (std::size_t p = 0; p < term.values.size(); ++p)
      if (term.free_shape(p)) return true;
  return false;
}

std::string method_of(const IdentifyOptions& options, const model::Model& model) {
  const bool shapes = has_free_shapes(model);
  if (options.method == "ls" && shapes)
    throw UsageError(
        "the model has shape parameters, which least squares alone does not find; give --method nls, or state them "
        "with fixed = true");
  if (options.method == "iv" || options.method == "oe")
    throw UsageError(fmt::format("--method {} is not built yet; use ls or nls", options.method));
  return options.method.empty() ? (shapes ? "nls" : "ls") : options.method;
}

}  // namespace

int run(const IdentifyOptions& options, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_model(options.model);
  const std::string method = method_of(options, file.model);
  const data::Dataset dataset = load(options.data, console);
  console.progress("estimating the parameters");
  const auto found = regression::identify(dataset, file.model, options.pipeline.options());
  for (const std::string& warning : found->warnings) console.warn(warning);
  console.line(output::identification_text(*found));

  if (options.out.empty()) {
    console.line();
    console.line("No file was written: --out MODEL writes the model with these values.");
  } else {
    // What only the data set knows of the drive stays there: the file keeps what its author wrote.
    model::Model changed = file.model;
    regression::store(changed, found->estimates);
    model::save(options.out, model::rewrite(file, changed));
    console.line();
    console.line(fmt::format("{} holds these values.", options.out.string()));
    console.line("Next:");
    console.line(fmt::format("  flexspline compare --model {} {}", quoted(options.out.string()),
                             as_arguments(options.data.data)));
  }
  if (!options.report.empty())
    write_report(options.report,
                 {.command = "identify",
                  .data_name = as_arguments(options.data.data),
                  .model_name = options.model.string(),
                  .dataset = &dataset,
                  .model = found->model,
                  .pipeline = options.pipeline.options(),
                  .estimates = found->estimates},
                 console);
  output::save_json(options.json, output::identification_json(*found, method));
  return kDone;
}

}  // namespace flexspline::cli
