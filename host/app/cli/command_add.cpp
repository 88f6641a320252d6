#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/report_option.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/user_defined_effects.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/learned_table.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/signature.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using output::number;
using selection::Addition;

constexpr std::string_view kAdd =
    "flexspline add viscous_asymmetry --model demo-out/base-model.toml demo-out --out better.toml";

struct ChangeOptions {
  std::string effect;
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;
  std::filesystem::path report;  // empty: none
  std::string json;
};
struct AddOptions : ChangeOptions {
  selection::UserDefinition user_defined;
};
struct RemoveOptions : ChangeOptions {};

constexpr int kDigits = 5;  // an interval of 0.1 % is still one

std::string percent_change(double before, double after) {
  return before > 0.0 ? fmt::format("{:+.1f} %", 100.0 * (after / before - 1.0)) : "-";
}

void print(const Addition& change, const std::string& what, Console& console) {
  console.line(console.bold(what));
  output::Table table({change.signal, "before", "after", "unit", "change"}, "lrrlr");
  table.row({"error on fitted data", number(change.before.rmse_fit), number(change.after.rmse_fit), change.unit,
             percent_change(change.before.rmse_fit, change.after.rmse_fit)});
  if (change.before.rmse_holdout && change.after.rmse_holdout)
    table.row({"error on held-out data", number(*change.before.rmse_holdout), number(*change.after.rmse_holdout),
               change.unit, percent_change(*change.before.rmse_holdout, *change.after.rmse_holdout)});
  if (change.noise_floor)
    table.row(
        {fmt::format("noise (from {})", change.noise_floor_from), "", number(*change.noise_floor), change.unit, ""});
  console.line(table.text());
  if (!change.before.rmse_holdout)
    console.line("  No data were held out: --holdout DATA would show whether this holds on others.");
  console.line();
  output::Table values({"all parameters", "value", "95 % interval", "", "unit"}, "lrrrl");
  for (const estimation::Estimate& e : change.estimates)
    values.row({fmt::format("{}.{}", e.id, e.parameter), number(e.value, kDigits), number(e.low, kDigits),
                number(e.high, kDigits), e.unit});
  console.line(values.text());
  for (const model::Effect& effect : change.model.effects)
    if (const std::string reference = output::reference_text(effect.type, change.model.drive); !reference.empty())
      console.line(fmt::format("  {}: {}", effect.id, reference));
  for (const auto& [id, learned] : change.tables) {
    console.line();
    console.line(output::learned_table_text(id, change.model.find(id)->definition->variable, learned, change.unit));
  }
}

json errors_json(const selection::Errors& errors) {
  return {{"rmse_fit", output::json_number(errors.rmse_fit)},
          {"rmse_holdout", output::json_number(errors.rmse_holdout)}};
}

json change_json(const Addition& change) {
  json parameters = json::array();
  for (const estimation::Estimate& e : change.estimates) parameters.push_back(output::json_parameter(e));
  json tables = json::array();
  for (const auto& [id, learned] : change.tables)
    tables.push_back(output::learned_table_json(id, *change.model.find(id)->definition, learned, change.unit));
  return {{"format", "flexspline-add/1"},
          {"effect", change.effect},
          {"signal", change.signal},
          {"unit", change.unit},
          {"before", errors_json(change.before)},
          {"after", errors_json(change.after)},
          {"noise_floor", output::json_number(change.noise_floor)},
          {"noise_floor_from", change.noise_floor_from},
          {"parameters", std::move(parameters)},
          {"tables", std::move(tables)},
          {"warnings", change.warnings}};
}

using Change = std::function<Addition(const data::Dataset&, const model::Model&)>;

void write_page(const ChangeOptions& options, const std::string& command, const data::Dataset& dataset,
                const model::Model& before, const Addition& changed, Console& console) {
  if (options.report.empty()) return;
  const estimation::PipelineOptions pipeline = options.pipeline.options();
  write_report(options.report,
               {.command = command,
                .data_name = as_arguments(options.data.data),
                .model_name = options.out.string(),
                .dataset = &dataset,
                .model = changed.model,
                .before = estimation::identify(dataset, before, pipeline)->model,
                .pipeline = pipeline,
                .estimates = changed.estimates,
                .addition = changed},
               console);
}

int change_model(const ChangeOptions& options, const std::string& command, const std::string& what,
                 const Change& change, Console& console) {
  require_report_place(options.report);
  const model::ModelFile file = load_searched_model(options.model);
  const data::Dataset dataset = load(options.data, console);
  console.progress("refitting the model");
  const Addition changed = change(dataset, file.model);
  for (const std::string& warning : changed.warnings) console.warn(warning);
  // Facts of the drive that only the data set has are not written into the model file.
  model::Model stored = changed.model;
  stored.drive = file.model.drive;
  model::save(options.out, model::signed_by_tool(model::rewrite(file, stored)));
  print(changed, what, console);
  console.line();
  console.line(fmt::format("{} holds the model. Next:", options.out.string()));
  const std::string arguments =
      fmt::format("--model {} {}", quoted(options.out.string()), as_arguments(options.data, options.pipeline));
  console.line(fmt::format("  flexspline compare {}", arguments));
  console.line(fmt::format("  flexspline diagnose {}", arguments));
  write_page(options, command, dataset, file.model, changed, console);
  output::save_json(options.json, change_json(changed));
  return kDone;
}

void require_no_definition(const AddOptions& options) {
  const selection::UserDefinition& d = options.user_defined;
  const char* const given = !d.formula.empty()      ? "--formula"
                            : !d.parameters.empty() ? "--parameter"
                            : d.points              ? "--points"
                            : !d.balance.empty()    ? "--balance"
                                                    : nullptr;
  if (given != nullptr)
    throw UsageError(
        fmt::format("{} is of table_effect and expression_effect; {} is an effect of the catalogue, "
                    "leave the option out",
                    given, options.effect));
}

int run(const AddOptions& options, Console& console) {
  require_effect(options.effect.substr(0, options.effect.find(':')));
  // A wrong name is reported before files are read.
  if (selection::names_user_defined_effect(options.effect))
    selection::user_defined_effect(options.effect, options.user_defined, {});
  else {
    selection::parse_effect(options.effect);
    require_no_definition(options);
  }
  return change_model(
      options, "add", fmt::format("{} added", options.effect),
      [&](const data::Dataset& dataset, const model::Model& model) {
        return selection::add(dataset, model, options.effect, options.pipeline.options(), options.user_defined);
      },
      console);
}

int run(const RemoveOptions& options, Console& console) {
  return change_model(
      options, "remove", fmt::format("{} taken out", options.effect),
      [&](const data::Dataset& dataset, const model::Model& model) {
        return selection::remove(dataset, model, options.effect, options.pipeline.options());
      },
      console);
}

void take_change(Parser& parser, ChangeOptions& options, const std::string& effect_help) {
  parser.option("EFFECT", options.effect, effect_help).required().value("");
  take_data(parser, options.data);
  take_model(parser, options.model);
  parser.option("--out", options.out, "the changed model").required().value("OUT");
  take_holdout(parser, options.data);
  take_report(parser, options.report);
  take_pipeline(parser, options.pipeline);
}

void declare(Parser& parser, AddOptions& options) {
  take_change(parser, options,
              "effect of the catalogue; torque_ripple:2 gives an order; table_effect:velocity learns a curve over a "
              "signal, table_effect:torque*direction one times the direction; expression_effect takes --formula");
  parser
      .option("--formula", options.user_defined.formula, "torque of an expression_effect, over signals and parameters")
      .value("TEXT");
  parser
      .option("--parameter", options.user_defined.parameters,
              "of the formula, with bounds where it does not only scale the torque; may be repeated")
      .value("NAME=LOW..HIGH:UNIT")
      .one_value_each_time();
  parser.option("--points", options.user_defined.points, "of a table_effect (default: chosen from the data)")
      .value("N");
  parser
      .option("--balance", options.user_defined.balance,
              "of a table_effect or expression_effect: motor, transmission or load; else where its signals belong")
      .value("NAME");
}

void declare(Parser& parser, RemoveOptions& options) {
  take_change(parser, options, "id of the effect in the model, or its type");
}

}  // namespace

Command add_command() {
  return command<AddOptions>(
      {"add",
       "adds an effect to a model and refits it, with the error before and after",
       "Adds an effect of the catalogue, re-estimates all parameters and reports what that does to the error, on the "
       "data that were fitted and on those held out. table_effect:SIGNAL learns a curve over a signal of your "
       "choice, as smooth as cross-validation chooses, where no effect of the catalogue fits; expression_effect fits "
       "a formula of your own. Comments and layout of the model file stay; its history gets a line. --report writes "
       "a page with plots, with the error before and after.",
       {kMakeData, kAdd,
        "flexspline add expression_effect --formula 'a*abs(velocity)' --parameter a:N*m*s/rad --model "
        "demo-out/base-model.toml demo-out --out better.toml"}},
      declare, run);
}

Command remove_command() {
  return command<RemoveOptions>(
      {"remove",
       "takes an effect out of a model and refits it, and shows what that costs",
       "Takes an effect out, by its id or its type, re-estimates the rest and reports what that does to the error, on "
       "the data that were fitted and on those held out.",
       {kMakeData, kAdd, "flexspline remove coulomb_asymmetry --model better.toml demo-out --out smaller.toml"}},
      declare, run);
}

}  // namespace flexspline::cli
