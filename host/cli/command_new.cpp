#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "host/cli/commands.hpp"
#include "host/cli/first_project.hpp"
#include "host/cli/unfinished_project.hpp"
#include "host/output/json.hpp"
#include "host/output/text.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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
    FirstProject project = first_project(draft, options);
    for (const std::string& warning : project.warnings) console.warn(warning);
    base = std::move(project.base);
  } catch (const data::DataError& unusable) {
    leave_unfinished(draft, options, unusable, console);
    return kUnusable;
  } catch (const UsageError& open) {
    leave_unfinished(draft, options, open, console);
    return kUnusable;
  }

  make_folder(options.out);
  const std::string toml = text_of(draft, options.out);
  model::save(dataset_file, toml);
  model::save(model_file, text_of(base));

  console.line(console.bold("Guessed or decided; correct it in the files if it is wrong:"));
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
