#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/cli/commands.hpp"
#include "host/cli/report_option.hpp"
#include "host/estimation/estimate.hpp"
#include "host/model/signature.hpp"
#include "host/output/identification.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"

namespace flexspline::cli {
namespace {

// "inertia.inertia=1.07e-4"
estimation::SuppliedValue supplied_from(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.rfind('.', equals);
  std::size_t used = 0;
  double value = 0.0;
  try {
    if (equals != std::string::npos) value = std::stod(text.substr(equals + 1), &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (equals == std::string::npos || dot == std::string::npos || used == 0 || equals + 1 + used != text.size() ||
      !std::isfinite(value))
    throw UsageError(fmt::format("--supply {} is not EFFECT.PARAMETER=VALUE, as inertia.inertia=1.07e-4", text));
  return {text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), value};
}

estimation::Options options_from(const IdentifyOptions& options, Console& console) {
  estimation::Options how;
  how.method = estimation::method_from_name(options.method);
  how.intervals = estimation::intervals_from_name(options.intervals);
  for (const std::string& text : options.supply) how.supplied.push_back(supplied_from(text));
  how.starts = options.starts;
  how.seed = options.seed;
  how.progress = [&console](std::string_view what) { console.progress(std::string(what)); };
  return how;
}

}  // namespace

int run(const IdentifyOptions& options, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_model(options.model);
  const estimation::Options how = options_from(options, console);
  model::Model known = file.model;
  std::unique_ptr<estimation::Identification> found;
  const data::Dataset dataset = load(options.data, console);
  console.progress("estimating the parameters");
  try {
    for (const estimation::SuppliedValue& supplied : how.supplied) estimation::supply(known, supplied);
    found = estimation::estimate(dataset, known, options.pipeline.options(), how);
  } catch (const std::invalid_argument& unsuitable) {
    throw UsageError(unsuitable.what());
  }
  for (const std::string& warning : found->warnings) console.warn(warning);
  console.line(output::identification_text(*found));

  if (options.out.empty()) {
    console.line();
    console.line("No file was written: --out MODEL writes the model with these values.");
  } else {
    // Facts of the drive that only the data set has are not written into the model file.
    model::Model changed = known;
    estimation::store(changed, found->estimates);
    model::save(options.out, model::signed_by_tool(model::rewrite(file, changed)));
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
  const auto used = how.method == estimation::Method::automatic ? estimation::method_for(known) : how.method;
  output::save_json(options.json,
                    output::identification_json(*found, std::string(estimation::name_of(used)), options.intervals));
  return kDone;
}

}  // namespace flexspline::cli
