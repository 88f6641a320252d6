#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/common/text/nearest.hpp"
#include "host/drive_link/deployment/sha256.hpp"
#include "host/drive_link/drive/dataset_writer.hpp"
#include "host/drive_link/drive/recorder.hpp"
#include "host/engine/planning/report_plans.hpp"
#include "host/input/data/dataset_toml.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct RecordOptions {
  std::string drive;
  std::filesystem::path plan;
  std::filesystem::path out;
  bool yes = false;
  bool force = false;
  bool clear_fault = false;
  bool compensate = false;
  std::vector<std::string> runs;              // of the plan, by name; none: all
  std::optional<double> full_velocity_rad_s;  // of the report's plans
  std::optional<double> full_current_a;
  std::string json;
};

bool needs_a_person(const planning::Run& run) {
  return run.locked || run.load_torque_nm != 0.0 || run.temperature_c || !run.instructions.empty();
}
std::string task_of(const planning::Run& run) {
  std::string text = run.instructions;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (run.locked) add("lock the output");
  if (run.load_torque_nm != 0.0) add(fmt::format("apply {:g} N*m to the output", run.load_torque_nm));
  if (run.temperature_c) add(fmt::format("bring the housing to {:g} degC", *run.temperature_c));
  return text;
}

// Whether a person is there to do what runs need, before the first of them moves.
void require_person(const planning::Plan& plan, bool yes) {
  if (yes || isatty(STDIN_FILENO) != 0) return;
  for (const planning::Run& run : plan.runs)
    if (needs_a_person(run))
      throw UsageError(
          fmt::format("run \"{}\" needs a person ({}); record on a terminal, or give --yes when all of this is done",
                      run.name, task_of(run)));
}
// False: the user requested a stop.
bool prepared(const planning::Run& run, bool yes) {
  if (yes || !needs_a_person(run)) return true;
  fmt::print(stderr, "{}: {}. Enter when done, q to stop: ", run.name, task_of(run));
  std::fflush(stderr);
  std::string answer;
  return std::getline(std::cin, answer) && answer != "q";
}

json json_of(const drive::Recording& r) {
  json gaps = json::array();
  for (const drive::Gap& gap : r.gaps) gaps.push_back({{"from_s", gap.from_s}, {"frames", gap.frames}});
  return {{"name", r.run.name},
          {"samples", r.time_s.size()},
          {"duration_s", r.time_s.empty() ? 0.0 : r.time_s.back()},
          {"frames_lost", r.lost},
          {"frames_dropped_by_drive", r.dropped},
          {"gap_count", r.gap_count},
          {"gaps", gaps},
          {"complete", r.complete},
          {"ended", r.ended.empty() ? json() : json(r.ended)}};
}

void print(const drive::Recording& r, Console& console) {
  console.line(fmt::format("  {:<28} {:>8} samples, {:.3g} s{}", r.run.name, r.time_s.size(),
                           r.time_s.empty() ? 0.0 : r.time_s.back(),
                           r.complete ? std::string() : ", incomplete: " + r.ended));
  if (r.lost > 0)
    console.warn(
        fmt::format("{}: {} frames were lost in {} gaps, {} of them on the drive; the file names {}. Record "
                    "more slowly (sample_s), or on a faster line or machine",
                    r.run.name, r.lost, r.gap_count, r.dropped,
                    r.gap_count > r.gaps.size() ? fmt::format("the first {} gaps", r.gaps.size()) : "them"));
}

// Only the runs that were named, in the plan's order.
void keep_runs(planning::Plan& plan, const std::vector<std::string>& names) {
  std::vector<std::string_view> known;
  for (const planning::Run& run : plan.runs) known.push_back(run.name);
  for (const std::string& name : names)
    if (std::ranges::find(known, name) == known.end()) {
      const std::string near = text::nearest(name, known);
      throw UsageError(fmt::format(
          "the plan has no run \"{}\"; {}", name,
          near.empty() ? fmt::format("it has {}", fmt::join(known, ", ")) : fmt::format("did you mean {}?", near)));
    }
  if (!names.empty())
    std::erase_if(plan.runs, [&](const planning::Run& r) { return std::ranges::find(names, r.name) == names.end(); });
}

constexpr double kShareOfLimits = 0.9;  // is 100 % of the report

planning::FullScale full_scale_of(const drive::Scales& scales) {
  const auto of = [](fixed::Value share, double base) { return std::ldexp(share.raw, -fixed::kValueBits) * base; };
  const model::Limits& limits = scales.header.limits;
  return {kShareOfLimits * of(limits.velocity, scales.constants.velocity_base),
          kShareOfLimits * of(limits.current, scales.constants.current_base)};
}
planning::Plan report_plan_of(const RecordOptions& options, planning::FullScale full) {
  full.velocity_rad_s = options.full_velocity_rad_s.value_or(full.velocity_rad_s);
  full.current_a = options.full_current_a.value_or(full.current_a);
  const auto plan = planning::report_plan(options.plan.string(), full);
  if (plan) return *plan;
  std::string known;
  for (const planning::ReportPlan& one : planning::report_plans())
    known += fmt::format("{}{} ({})", known.empty() ? "" : "; ", one.name, one.title);
  throw UsageError(
      fmt::format("there is no file {} and no such plan of the report; there are {}", options.plan.string(), known));
}

// The measurements that commands read from this folder now.
std::vector<std::string> recordings_in(const fs::path& folder) {
  std::vector<std::string> names;
  if (!fs::is_directory(folder)) return names;
  if (const fs::path listed = folder / "dataset.toml"; fs::exists(listed)) {
    data::Findings findings;
    for (const data::ExperimentEntry& e : data::read_dataset_toml(listed, findings).experiments)
      names.push_back(e.file.lexically_normal().lexically_relative(folder.lexically_normal()).string());
    if (!names.empty()) return names;
  }
  for (const auto& entry : fs::directory_iterator(folder))
    if (const auto kind = entry.path().extension(); kind == ".csv" || kind == ".mat")
      names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}
// A new dataset.toml lists only the runs of this call: others would not be read any more.
void require_no_other_recordings(const fs::path& folder, const planning::Plan& plan) {
  for (const std::string& name : recordings_in(folder))
    if (std::ranges::none_of(plan.runs, [&](const planning::Run& run) { return run.name + ".csv" == name; }))
      throw UsageError(
          fmt::format("{}: has the measurement {}, which is not of this plan's runs and would not be read any more; "
                      "give another folder",
                      folder.string(), name));
}

planning::Plan plan_of(const RecordOptions& options, bool is_report) {
  planning::Plan plan = is_report ? report_plan_of(options, {100.0, 1.0}) : planning::read(options.plan);
  if (!is_report && (options.full_velocity_rad_s || options.full_current_a))
    throw UsageError(
        "--full-velocity-rad-s and --full-current-a are for the report's plans; another plan has its own sizes");
  keep_runs(plan, options.runs);
  if (plan.runs.empty()) throw UsageError(options.plan.string() + ": the plan has no [[run]]: nothing to record");
  require_empty_folder(options.out, options.force);
  require_no_other_recordings(options.out, plan);
  require_person(plan, options.yes);
  return plan;
}

struct RecordedRuns {
  std::vector<drive::Recording> all;
  std::string ended;    // why there are no more: by the user, a limit or a fault
  std::string failure;  // of the link or the drive
};

// One run after the other; each complete one is saved at once.
RecordedRuns record_runs(drive::Recorder& recorder, const planning::Plan& plan, const drive::Scales& scales,
                         const drive::Origin& origin, drive::Measures measures, const RecordOptions& options,
                         Console& console) {
  RecordedRuns recorded;
  for (std::size_t i = 0; i < plan.runs.size() && recorded.ended.empty(); ++i) {
    const planning::Run& run = plan.runs[i];
    if (!prepared(run, options.yes)) {
      recorded.ended = "interrupted";
      break;
    }
    try {
      // Until an index pulse comes, or somebody homes it, a drive with an encoder that only counts knows neither.
      const protocol::Reference known = recorder.reference();
      measures.knows_turn = known.knows_turn;
      measures.knows_output = known.knows_output;
      drive::Recording r =
          recorder.record(run, {Interruptible::interrupted, [&](double time_s) {
                                  console.progress(fmt::format("run {} of {}, {}: {:.1f} of {:g} s", i + 1,
                                                               plan.runs.size(), run.name, time_s, run.duration_s));
                                }});
      print(r, console);
      recorded.ended = r.ended;
      if (r.complete) model::save(options.out / (run.name + ".csv"), drive::csv_of(r, scales, origin, measures));
      recorded.all.push_back(std::move(r));
    } catch (const std::exception& error) {
      // What was finished is worth keeping.
      recorded.failure = error.what();
      break;
    }
  }
  return recorded;
}

void save_answer(const RecordedRuns& recorded, const drive::Origin& origin, const std::string& file) {
  json runs = json::array();
  for (const drive::Recording& r : recorded.all) runs.push_back(json_of(r));
  output::save_json(file,
                    {{"format", "flexspline-record/1"},
                     {"drive", {{"serial", origin.serial}, {"board", origin.board}, {"firmware", origin.firmware}}},
                     {"block_sha256", origin.block_sha256},
                     {"ended", !recorded.failure.empty() ? json(recorded.failure)
                               : recorded.ended.empty()  ? json()
                                                         : json(recorded.ended)},
                     {"runs", runs}});
}

int run(const RecordOptions& options, Console& console) {
  const bool is_report = options.plan.string().starts_with("report-") && !fs::exists(options.plan);
  planning::Plan plan = plan_of(options, is_report);
  drive::Session session = open_drive(options.drive);
  const drive::Bytes block = session.read_block(protocol::Which::active);
  const drive::Scales scales = drive::scales_of(session);
  if (is_report) {
    plan = report_plan_of(options, full_scale_of(scales));
    keep_runs(plan, options.runs);
  }
  drive::Recorder recorder(session, scales, plan, options.compensate);
  const protocol::Identity& id = session.identity();
  const drive::Origin origin{session.serial(), session.board(), fmt::format("{}.{}", id.firmware[0], id.firmware[1]),
                             deployment::sha256(block)};
  make_folder(options.out);
  if (options.clear_fault) recorder.clear_fault();
  console.line(named(session));
  const Interruptible interruptible;
  const RecordedRuns recorded =
      record_runs(recorder, plan, scales, origin, drive::measures_of(block), options, console);
  const auto complete =
      std::count_if(recorded.all.begin(), recorded.all.end(), [](const auto& r) { return r.complete; });
  if (complete > 0) model::save(options.out / "dataset.toml", drive::dataset_toml_of(recorded.all, scales, origin));
  save_answer(recorded, origin, options.json);
  const std::string kept = fmt::format("{} of {} runs are in {}", complete, plan.runs.size(), options.out.string());
  if (!recorded.failure.empty()) throw drive::DriveError(fmt::format("{} ({})", recorded.failure, kept));
  if (!recorded.ended.empty()) {
    console.error(fmt::format("{}; the drive is at rest; {}", recorded.ended, kept));
    return kNotMet;
  }
  console.line(kept);
  return kDone;
}

void declare(Parser& parser, RecordOptions& options) {
  std::string names;
  for (const planning::ReportPlan& plan : planning::report_plans())
    names += (names.empty() ? "" : ", ") + std::string(plan.name);
  take_drive(parser, options.drive);
  parser.option("--plan", options.plan, "motions: of flexspline plan, by hand, or the report's by name: " + names)
      .required()
      .value("PLAN");
  parser.option("--out", options.out, "folder for the measurements").required().value("DIR");
  parser.flag("--force", options.force, "write into a folder that is not empty");
  parser.option("--runs", options.runs, "only these runs of the plan, by name (default: all)")
      .comma_separated()
      .value("NAME")
      .one_value_each_time();
  parser.flag("--compensate", options.compensate, "runs of mode position with feedforward of the model on the drive");
  parser
      .option("--full-velocity-rad-s", options.full_velocity_rad_s,
              "motor velocity that is 100 % in the report's plans (default: nine tenths of the drive's limit)")
      .positive()
      .value("RAD/S");
  parser
      .option("--full-current-a", options.full_current_a,
              "motor current that is 100 % in the report's plans (default: nine tenths of the drive's limit)")
      .positive()
      .value("A");
  parser.flag("--clear-fault", options.clear_fault, "clear the present fault first; its cause must be gone");
  take_yes(parser, options.yes);
}

}  // namespace

Command record_command() {
  return command<RecordOptions>(
      {"record",
       "runs the motions of a plan on a drive and saves the measurements",
       "Runs each motion of a plan on the drive itself (currents and velocities as its excitation, positions by its "
       "trajectory, from the present position of the shaft), at most at the plan's limits and the drive's, and "
       "writes a data set: a CSV file for each run with the drive's identity and its block's hash, and dataset.toml. "
       "Frames that got lost are counted and named in the file. Ctrl-C, a limit or a fault brings the drive to rest; "
       "what was finished before is kept (exit code 1). Runs that need a person (a locked output, a load) ask on a "
       "terminal, and without one need --yes.",
       {kMakeData, kIdentify,
        "flexspline plan --model fitted.toml --run-s 2 --motions 1 --without off,locked,load,temperature --out "
        "plan.toml",
        "flexspline record --drive twin --plan plan.toml --out recorded",
        "flexspline record --drive twin --plan report-friction --runs 50-1-10 --out recorded-as-in-the-report"}},
      declare, run);
}

}  // namespace flexspline::cli
