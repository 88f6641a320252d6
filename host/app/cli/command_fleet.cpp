#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/fleet/siblings.hpp"
#include "host/common/text/build_identity.hpp"
#include "host/drive_link/deployment/sha256.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/estimate.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/input/data/dataset_toml.hpp"
#include "host/input/data/recording.hpp"
#include "host/output/answers/comparison.hpp"
#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct FleetOptions {
  std::string action;  // run, merge
  std::vector<std::filesystem::path> places;
  std::filesystem::path model;  // empty: base-model.toml of each folder
  std::filesystem::path out;    // run: file for the result; empty: in the drive's folder
  bool diagnose = false;
  bool again = false;
  std::vector<std::string> tolerate;
  PipelineInputs pipeline;
  std::optional<double> limit;  // merge: of |z|
  std::string json;
};

constexpr int kFleetDigits = 4;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw UsageError(fmt::format("{} cannot be read; is the path right?", file.string()));
  return {std::istreambuf_iterator<char>(in), {}};
}
std::string hash_of(const std::string& text) {
  return deployment::sha256({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

struct Task {
  fs::path folder;
  fs::path model;
  fs::path out;
  std::string name;
  std::string fingerprint;  // of all that the result depends on
};

// All that is read where the folder is the data: its recordings, or dataset.toml with those that it names, which may be
// in other folders.
std::vector<fs::path> measurements_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && (data::is_recording(entry.path()) || entry.path().filename() == "dataset.toml"))
      files.push_back(entry.path());
  const fs::path toml = folder / "dataset.toml";
  std::error_code error;
  try {
    data::Findings ignored;
    if (fs::exists(toml, error))
      for (const data::ExperimentEntry& entry : data::read_dataset_toml(toml, ignored).experiments)
        if (fs::is_regular_file(entry.file, error)) files.push_back(entry.file);
  } catch (const data::DataError&) {
    // The run reports it.
  }
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

Task task_of(const FleetOptions& options, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw UsageError(
        fmt::format("{} is not a folder; fleet run takes the folder of one drive's measurements", folder.string()));
  Task task{folder,
            options.model.empty() ? folder / "base-model.toml" : options.model,
            options.out.empty() ? folder / fleet::kResultName : options.out,
            {},
            {}};
  const fs::path whole = fs::absolute(folder).lexically_normal();
  task.name = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  if (!fs::exists(task.model, error))
    throw UsageError(fmt::format("there is no model {}; give --model MODEL, or put base-model.toml into the folder",
                                 task.model.string()));
  std::string all = fmt::format("{} {} {} {}", text::tool_name(), options.diagnose,
                                options.pipeline.cutoff_hz.value_or(0.0), fmt::join(options.tolerate, ","));
  all += hash_of(content_of(task.model));
  for (const fs::path& file : measurements_of(folder)) all += file.filename().string() + hash_of(content_of(file));
  task.fingerprint = hash_of(all);
  return task;
}

// Whether a result of the very same files is there. A drive that failed is tried again.
bool is_done(const Task& task) {
  std::ifstream in(task.out, std::ios::binary);
  if (!in) return false;
  const json content = json::parse(in, nullptr, false);
  return content.is_object() && content.value("format", json()) == json(fleet::kResultFormat) &&
         content.value("fingerprint", json()) == json(task.fingerprint) && content.value("failed", json("?")).is_null();
}

json result_of(const FleetOptions& options, const Task& task, Console& console) {
  DataInputs inputs;
  inputs.data = {task.folder};
  inputs.tolerate = options.tolerate;
  const data::Dataset dataset = load(inputs, console);
  const model::ModelFile file = load_model(task.model);
  const estimation::PipelineOptions pipeline = options.pipeline.options();
  console.progress("estimating the parameters");
  const auto found = estimation::estimate(dataset, file.model, pipeline);
  const json identified = output::identification_json(*found, "standard");
  console.progress("comparing model and measurement");
  json errors = json::array();
  try {
    errors = output::comparison_json(comparison::compare(dataset, found->model, pipeline))["overall"];
  } catch (const model::ModelError& error) {
    // Measurements that do not show every effect of the model still identify the other parameters.
    console.warn(fmt::format("{}: {}", task.name, error.what()));
  }
  json answer = {{"parameters", identified["parameters"]},
                 {"errors", errors},
                 {"warnings", identified["warnings"]},
                 {"diagnosis", nullptr}};
  if (options.diagnose) {
    selection::Options how;
    how.pipeline = pipeline;
    how.progress = [&](std::string_view stage) { console.progress(stage); };
    const json diagnosed = output::diagnosis_json(selection::diagnose(dataset, file.model, how));
    answer["diagnosis"] = {
        {"verdict", diagnosed["verdict"]}, {"named", diagnosed["named"]}, {"base", diagnosed["base"]}};
  }
  return answer;
}

// Whether the drive has a result now.
bool run_one(const FleetOptions& options, const fs::path& folder, Console& console, json& answers) {
  const Task task = task_of(options, folder);
  if (!options.again && is_done(task)) {
    console.line(fmt::format("{}: done before ({})", task.name, task.out.string()));
    answers.push_back({{"drive", task.name}, {"file", task.out.string()}, {"skipped", true}, {"failed", nullptr}});
    return true;
  }
  const auto save = [&](json result, const json& failed) {
    result["format"] = fleet::kResultFormat;
    result["drive"] = task.name;
    result["fingerprint"] = task.fingerprint;
    result["failed"] = failed;
    output::save_json(task.out.string(), result);
  };
  // What a job that is killed leaves behind; without it the drive would be missing without a message.
  save(json::object(), "its run has not finished: it was stopped, or is still running");
  json result;
  std::string failed;
  try {
    result = result_of(options, task, console);
  } catch (const std::exception& error) {
    failed = error.what();
    console.error(fmt::format("{}: {}", task.name, failed));
  }
  const json reason = failed.empty() ? json() : json(failed);
  save(result, reason);
  if (failed.empty()) console.line(fmt::format("{}: {}", task.name, task.out.string()));
  answers.push_back({{"drive", task.name}, {"file", task.out.string()}, {"skipped", false}, {"failed", reason}});
  return failed.empty();
}

int run_drives(const FleetOptions& options, Console& console) {
  if (options.limit) throw UsageError("--limit is of fleet merge");
  if (!options.out.empty() && options.places.size() > 1)
    throw UsageError("--out is one file, for one drive; leave it out, and each folder gets its result");
  json answers = json::array();
  bool all = true;
  for (const fs::path& folder : options.places) all = run_one(options, folder, console, answers) && all;
  output::save_json(options.json, {{"format", "flexspline-fleet-run/1"}, {"drives", answers}});
  return all ? kDone : kUnusable;
}

std::string in_words(const fleet::Difference& d) {
  return fmt::format(
      "{}: {} is {}, {} the median of the other drives ({}), by {} times {} (the larger of their scatter and its own "
      "uncertainty).",
      d.drive, d.name, output::with_unit(d.value, d.unit), d.z > 0.0 ? "above" : "below",
      output::with_unit(d.median, d.unit), output::number(std::abs(d.z), 3), output::with_unit(d.deviation, d.unit));
}
std::string verdict_of(const fleet::DriveResult& result) {
  std::string text = result.verdict;
  for (const std::string& effect : result.named) text += " " + effect;
  return text;
}

json json_of(const fleet::Merged& merged, std::size_t drives) {
  json answer = {
      {"format", "flexspline-fleet/1"},  {"drives", drives},           {"limit", output::json_number(merged.limit)},
      {"quantities", json::array()},     {"different", json::array()}, {"usual_verdict", nullptr},
      {"other_verdicts", json::array()}, {"failed", json::array()}};
  for (const fleet::Spread& s : merged.spreads)
    answer["quantities"].push_back({{"name", s.name},
                                    {"unit", s.unit},
                                    {"drives", s.drives},
                                    {"median", output::json_number(s.median)},
                                    {"deviation", output::json_number(s.deviation)}});
  for (const fleet::Difference& d : merged.differences)
    answer["different"].push_back({{"drive", d.drive},
                                   {"name", d.name},
                                   {"unit", d.unit},
                                   {"value", output::json_number(d.value)},
                                   {"median", output::json_number(d.median)},
                                   {"deviation", output::json_number(d.deviation)},
                                   {"z", output::json_number(d.z)}});
  if (!merged.usual_verdict.empty()) answer["usual_verdict"] = merged.usual_verdict;
  for (const fleet::DriveResult* r : merged.verdicts)
    answer["other_verdicts"].push_back({{"drive", r->drive}, {"verdict", r->verdict}, {"named", r->named}});
  for (const fleet::DriveResult* r : merged.failed)
    answer["failed"].push_back({{"drive", r->drive}, {"reason", r->failed}});
  return answer;
}

int merge_results(const FleetOptions& options, Console& console) {
  if (!options.model.empty() || !options.out.empty() || options.diagnose || options.again)
    throw UsageError("fleet merge takes results, --limit and --json alone");
  if (options.limit && !(*options.limit > 0.0)) throw UsageError("--limit is a number above zero, as in --limit 6");
  const std::vector<fleet::DriveResult> results = fleet::read_results(options.places);
  const fleet::Merged merged = fleet::merge(results, options.limit);
  output::Table table({"quantity", "drives", "median", "deviation", "unit"}, "lrrrl");
  for (const fleet::Spread& s : merged.spreads)
    table.row({s.name, std::to_string(s.drives), output::number(s.median, kFleetDigits), output::number(s.deviation, 3),
               s.unit});
  console.line(fmt::format("{} drives, {} of them without a result", results.size(), merged.failed.size()));
  if (!merged.spreads.empty()) console.line(table.text());
  console.line();
  const std::size_t good = results.size() - merged.failed.size();
  if (good < fleet::kFewestDrives) {
    console.line(
        output::wrapped(fmt::format("With {} drives none can be distinguished from its siblings: {} are needed.", good,
                                    fleet::kFewestDrives),
                        0));
  } else if (merged.differences.empty() && merged.verdicts.empty()) {
    console.line(
        fmt::format("No drive differs from its siblings (limit: {} deviations).", output::number(merged.limit, 3)));
  } else {
    console.line(console.bold(fmt::format("Different (limit: {} deviations)", output::number(merged.limit, 3))));
  }
  for (const fleet::Difference& d : merged.differences) console.line(output::wrapped(in_words(d), 2, 2));
  for (const fleet::DriveResult* r : merged.verdicts)
    console.line(output::wrapped(
        fmt::format("{}: diagnose says {}; of most it says {}.", r->drive, verdict_of(*r), merged.usual_verdict), 2,
        2));
  for (const fleet::DriveResult* r : merged.failed)
    console.line(output::wrapped(fmt::format("{} has no result: {}", r->drive, r->failed), 2, 2));
  output::save_json(options.json, json_of(merged, results.size()));
  return kDone;
}

int run(const FleetOptions& options, Console& console) {
  if (options.action == "run") return run_drives(options, console);
  if (options.action == "merge") return merge_results(options, console);
  throw UsageError(
      fmt::format("there is no \"fleet {}\"; it is fleet run FOLDER, or fleet merge RESULTS", options.action));
}

void declare(Parser& parser, FleetOptions& options) {
  parser.option("ACTION", options.action, "run: one drive; merge: the results of all").required().value("{run,merge}");
  parser.option("FOLDER", options.places, "run: a drive's measurements; merge: results, or folders with them")
      .required()
      .value("");
  parser.option("--model", options.model, "run: model to identify (default: base-model.toml in the folder)")
      .value("MODEL");
  parser.flag("--diagnose", options.diagnose, "run: diagnose, too");
  parser.flag("--again", options.again, "run: even where there is a result of the same files");
  parser.option("--out", options.out, "run: file for the result (default: fleet-result.json in the folder)")
      .value("FILE");
  parser.option("--tolerate", options.tolerate, "run: treat a finding as a warning")
      .value("KIND")
      .comma_separated()
      .one_value_each_time();
  parser.option("--cutoff-hz", options.pipeline.cutoff_hz, "run: cut-off of both filters (default: from the data)")
      .value("HZ");
  parser
      .option("--limit", options.limit,
              "merge: robust z-score beyond which a drive differs (default: what one fleet in a hundred of equal "
              "drives exceeds)")
      .value("Z");
}

}  // namespace

Command fleet_command() {
  return command<FleetOptions>(
      {"fleet",
       "many drives: one command a drive, then which of them differs from its siblings",
       "run identifies a drive (with --diagnose diagnoses it, too) and writes fleet-result.json next to its "
       "measurements; if that exists already, of the same files and the same build, nothing is done, so the "
       "command can be repeated after a stop. It is for a scheduler: parallel flexspline fleet run {} ::: "
       "drives/*, or in a Slurm array job: all=(drives/*); flexspline fleet run \"${all[$SLURM_ARRAY_TASK_ID]}\". "
       "merge reads the results, reports how each parameter and each error is distributed over the drives, and names "
       "drives that are further off than their siblings' scatter explains; at least five drives are needed.",
       {"flexspline-hil record --out drives/one --seed 1", "flexspline fleet run drives/one",
        "flexspline fleet merge drives"}},
      declare, run);
}

}  // namespace flexspline::cli
