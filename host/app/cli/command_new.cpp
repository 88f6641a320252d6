#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/unfinished_project.hpp"
#include "host/app/project/first_project.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using project::BaseModel;
using project::ColumnGuess;
using project::Draft;
using project::FirstProject;

struct NewOptions {
  project::Request request;
  bool force = false;
  std::string json;
};

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
          {"dataset", (options.request.out / "dataset.toml").string()},
          {"model", (options.request.out / "base-model.toml").string()},
          {"columns", std::move(columns)},
          {"unused_columns", draft.unused},
          {"experiments", draft.toml.experiments.size()},
          {"effects", std::move(effects)},
          {"notes", draft.notes}};
}

int run(const NewOptions& options, Console& console) {
  const fs::path dataset_file = options.request.out / "dataset.toml";
  const fs::path model_file = options.request.out / "base-model.toml";
  for (const fs::path& file : {dataset_file, model_file})
    if (!options.force && fs::exists(file) && !is_unfinished(file))
      throw UsageError(
          fmt::format("{} is there already; give another --out, or --force to write over it", file.string()));

  console.progress("reading the measurements");
  Draft draft = draft_of(options.request);
  BaseModel base;
  try {
    FirstProject project = first_project(draft, options.request);
    for (const std::string& warning : project.warnings) console.warn(warning);
    base = std::move(project.base);
  } catch (const data::DataError& unusable) {
    leave_unfinished(draft, options.request, unusable, console);
    return kUnusable;
  } catch (const project::RequestError& open) {
    leave_unfinished(draft, options.request, open, console);
    return kUnusable;
  }

  make_folder(options.request.out);
  const std::string toml = text_of(draft, options.request.out);
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
  const std::string out = quoted(options.request.out.string());
  const std::string fitted = quoted((options.request.out / "fitted.toml").string());
  console.line(fmt::format("  flexspline check {}", out));
  console.line(fmt::format("  flexspline identify {} --model {} --out {}", out, quoted(model_file.string()), fitted));
  console.line(fmt::format("  flexspline compare --model {} {}", fitted, out));
  console.line(fmt::format("  flexspline diagnose --model {} {}", fitted, out));
  output::save_json(options.json, json_of(options, draft, base));
  return kDone;
}

void declare(Parser& parser, NewOptions& options) {
  parser.option("--from", options.request.data, kDataHelp).required().value("DATA");
  parser.option("--out", options.request.out, "folder for dataset.toml and base-model.toml").required().value("DIR");
  parser
      .option("--map", options.request.map,
              "a column of ours is theirs, in this unit, or times this number; may be repeated")
      .value("OURS=THEIRS[:UNIT]")
      .one_value_each_time();
  parser
      .option("--without", options.request.without,
              "a column of theirs that is not to be used, whatever its name says; may be repeated")
      .value("THEIRS")
      .one_value_each_time();
  parser
      .option("--turn", options.request.turned,
              "a column of ours whose sign is the other one, as current_a where a positive current decelerates; may "
              "be repeated")
      .value("OURS")
      .one_value_each_time();
  parser.option("--axis", options.request.axis, "rotary, or linear (m, m/s, N)").one_of({"rotary", "linear"}).value("");
  parser
      .option("--load", options.request.load,
              "the output: free, or locked so that it cannot turn, in all recordings of DATA (default: as they state, "
              "else free); where they differ, correct load under each [[experiment]] of dataset.toml")
      .one_of({"free", "locked"})
      .value("");
  parser.option("--gear-ratio", options.request.gear_ratio, "motor turns per output turn").positive().value("N");
  parser
      .option("--position-side", options.request.position_side,
              "where the only position and velocity are measured: link or motor. Of the link, with --gear-ratio N, "
              "the motor's are N times those, as most robots log them together with the motor's current")
      .one_of({"link", "motor"})
      .value("");
  parser.option("--joint", options.request.joint, "of a file with several joints, by the number in the names")
      .not_negative()
      .value("K");
  parser.option("--torque-constant", options.request.torque_constant_nm_a, "motor torque per ampere, N*m/A")
      .positive()
      .value("KM");
  parser
      .option("--encoder-counts", options.request.encoder_counts, "counts per motor turn (per metre on a linear axis)")
      .positive()
      .value("COUNTS");
  parser.option("--pitch-m", options.request.pitch_m, "of a linear axis: travel of one motor turn, m")
      .positive()
      .value("METRES");
  parser
      .option("--pole-pairs", options.request.pole_pairs,
              "of the motor, where the log has its speed in electrical turns")
      .within(1, 1000)
      .value("P");
  parser.flag("--force", options.force, "write over a dataset.toml and base-model.toml that are there");
  take_tolerate(parser, options.request.tolerate);
}

}  // namespace

Command new_command() {
  return command<NewOptions>(
      {"new",
       "first dataset.toml and base model from measurements",
       "Reads recordings as a logger left them (CSV, also of scopes and compressed by gzip; MAT; HDF5; NumPy; bags of "
       "ROS 1 and 2 and MCAP, by topic and field; logs of moteus), finds out which column is what from names, units "
       "and motion, and writes two files into a new folder: dataset.toml, which maps the columns to the names of the "
       "tool, and base-model.toml, with the effects that these signals can show. The measurements are not changed. "
       "What is guessed is printed, and written as a comment into the files; --map and the other options overrule "
       "it. A robot's log, with the position of the link together with the current of the motor, takes "
       "--position-side link --gear-ratio N. A single record is split into a part to fit and a part to verify. What "
       "cannot be finished is left as a draft, with the command to continue.",
       {kMakeData, "flexspline new --from demo-out --out project"}},
      declare, run);
}

}  // namespace flexspline::cli
