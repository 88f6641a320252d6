#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/engine/estimation/estimate.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/signature.hpp"

namespace flexspline::cli {
namespace {

struct IdentifyOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;  // empty: print only
  std::string method;         // empty: what the model needs
  std::string intervals = "standard";
  std::vector<std::string> supply;  // EFFECT.PARAMETER=VALUE
  int starts = 3;
  std::uint64_t seed = 1;
  std::filesystem::path report;  // empty: none
  std::string json;
};

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
  how.starts = options.starts;
  how.seed = options.seed;
  how.progress = [&console](std::string_view what) { console.progress(std::string(what)); };
  return how;
}

int run(const IdentifyOptions& options, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_model(options.model);
  const estimation::Options how = options_from(options, console);
  model::Model known = file.model;
  std::unique_ptr<estimation::Identification> found;
  const data::Dataset dataset = load(options.data, console);
  console.progress("estimating the parameters");
  try {
    for (const std::string& text : options.supply) estimation::supply(known, supplied_from(text));
    found = estimation::estimate(dataset, known, options.pipeline.options(), how);
  } catch (const std::invalid_argument& unsuitable) {
    throw UsageError(unsuitable.what());
  }
  for (const std::string& warning : output::warnings_of(*found)) console.warn(warning);
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
                             as_arguments(options.data, options.pipeline)));
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
  output::save_json(options.json, output::identification_json(*found, options.intervals));
  return kDone;
}

void declare(Parser& parser, IdentifyOptions& options) {
  take_data(parser, options.data);
  take_model(parser, options.model);
  parser.option("--out", options.out, "the model with the values in it (default: print only)").value("MODEL");
  parser
      .option(
          "--method", options.method,
          "ls: least squares; nls: with a search for nonlinear parameters; partitioned: linear parameters first, then "
          "the others, on fast and on slow records where there are both; iv: instrumental variables, for noisy "
          "velocities; oe: least error of the free run (default: ls or nls, as the model needs)")
      .one_of({"ls", "nls", "partitioned", "iv", "oe"})
      .value("");
  parser
      .option("--intervals", options.intervals,
              "standard: from standard errors, wider where twice the cut-off changes a value; profile: profile "
              "likelihood; bootstrap: of blocks of samples (ls and nls)")
      .one_of({"standard", "profile", "bootstrap"})
      .shows_default()
      .value("");
  parser
      .option(
          "--supply", options.supply,
          "a parameter that is known from another source, in its SI unit, as inertia.inertia=1.07e-4; may be repeated")
      .value("EFFECT.PARAMETER=VALUE")
      .one_value_each_time();
  parser.option("--starts", options.starts, "starts of the search for nonlinear parameters")
      .within(1, 100)
      .shows_default()
      .value("N");
  parser.option("--seed", options.seed, "of the random starts and of the bootstrap").shows_default().value("N");
  take_holdout(parser, options.data);
  take_report(parser, options.report);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command identify_command() {
  return command<IdentifyOptions>(
      {"identify",
       "estimates the parameters of a model",
       "Estimates every parameter that the model does not fix, from the experiments of role fit: for each experiment "
       "alone, with average and spread, and for all together with 95 % intervals. A spread above 30 % is flagged: "
       "the parameter is not reliable, or an effect is missing. \"excited\" is the share of a parameter's effect on "
       "the data that no other parameter can explain. With --out the model is written with the values; its comments "
       "and layout stay. --method iv or oe is for velocities so noisy that least squares is biased towards "
       "zero; --intervals profile or bootstrap for parameters whose uncertainty is not symmetric; --supply for "
       "a parameter that is known from another source, such as an inertia where the torque constant is not known "
       "either. --report writes a page with plots for a browser or a printer.",
       {kMakeData, kIdentify,
        "flexspline identify demo-out --model demo-out/base-model.toml --method iv --supply inertia.inertia=1.04e-4"}},
      declare, run);
}

}  // namespace flexspline::cli
