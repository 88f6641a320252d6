#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/base_model.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/project_draft.hpp"
#include "host/cli/unfinished_project.hpp"
#include "host/model/signature.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string name_of(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

json json_of(const NewOptions& options, const Draft& draft, const BaseModel& base) {
  json columns = json::array();
  for (const ColumnGuess& c : draft.columns)
    columns.push_back({{"column", c.ours},
                       {"source", c.theirs},
                       {"unit", c.unit.empty() ? json(nullptr) : json(c.unit)},
                       {"guessed", !c.why.empty()}});
  json effects = json::array();
  for (const model::Effect& effect : base.model.effects) effects.push_back(effect.type);
  return {{"format", "flexspline-new/1"},
          {"dataset", (options.out / "dataset.toml").string()},
          {"model", (options.out / "base-model.toml").string()},
          {"columns", std::move(columns)},
          {"unused_columns", draft.unused},
          {"experiments", draft.toml.experiments.size()},
          {"effects", std::move(effects)},
          {"notes", draft.notes}};
}

// The base model, and in the draft what only the values show.
BaseModel finish(Draft& draft, const NewOptions& options, Console& console) {
  if (!draft.open_question.empty()) throw UsageError(draft.open_question);
  data::Dataset dataset = load_draft(draft, options);
  for (const data::Finding& finding : dataset.findings)
    if (finding.severity == data::Severity::warning) console.warn(finding.text());
  complete(draft, dataset);
  for (const std::string& doubt : implausible_sides(draft, dataset)) console.warn(doubt);
  BaseModel base = base_model(dataset, name_of(options.out));
  if (base.model.effects.empty())
    throw UsageError(fmt::format("no torque balance can be formed from these columns: {}; name the columns with --map",
                                 output::listed(base.reasons, "and")));
  return base;
}

}  // namespace

int run(const NewOptions& options, Console& console) {
  const fs::path dataset_file = options.out / "dataset.toml";
  const fs::path model_file = options.out / "base-model.toml";
  for (const fs::path& file : {dataset_file, model_file})
    if (!options.force && fs::exists(file) && !is_unfinished(file))
      throw UsageError(
          fmt::format("{} is there already; give another --out, or --force to write over it", file.string()));

  console.progress("reading the measurements");
  Draft draft = draft_of(options);
  BaseModel base;
  try {
    base = finish(draft, options, console);
  } catch (const data::DataError& unusable) {
    leave_unfinished(draft, options, unusable, console);
    return kUnusable;
  } catch (const UsageError& open) {
    leave_unfinished(draft, options, open, console);
    return kUnusable;
  }

  make_folder(options.out);
  const std::string toml = text_of(draft, options.out);
  std::string model = "# A first model: the effects that these signals can show, to be identified.\n";
  for (const std::string& reason : base.reasons) model += fmt::format("# {}\n", reason);
  model += "\n" + model::write(base.model);
  model::save(dataset_file, toml);
  model::save(model_file, model::signed_by_tool(model));

  console.line(console.bold("Guessed or decided; mend it in the files where it is wrong:"));
  for (const std::string& note : draft.notes) console.line(output::wrapped("- " + note, 2, 2));
  if (!draft.unused.empty())
    console.line(output::wrapped(fmt::format("- not used: {}", output::listed(draft.unused)), 2, 2));
  console.line();
  console.line(console.bold("The base model has:"));
  for (const std::string& reason : base.reasons) console.line(output::wrapped("- " + reason, 2, 2));
  console.line();
  console.line(fmt::format("{} and {} are written. Next:", dataset_file.string(), model_file.string()));
  const std::string out = quoted(options.out.string());
  const std::string fitted = quoted((options.out / "fitted.toml").string());
  console.line(fmt::format("  flexspline check {}", out));
  console.line(fmt::format("  flexspline identify {} --model {} --out {}", out, quoted(model_file.string()), fitted));
  console.line(fmt::format("  flexspline compare --model {} {}", fitted, out));
  console.line(fmt::format("  flexspline diagnose --model {} {}", fitted, out));
  output::save_json(options.json, json_of(options, draft, base));
  return kDone;
}

}  // namespace flexspline::cli
