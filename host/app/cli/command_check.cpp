#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/project/base_model.hpp"
#include "host/input/data/record_summary.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using output::json_number;
using output::number;

struct CheckOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::string json;
};

std::string severity_name(data::Severity severity) {
  switch (severity) {
    case data::Severity::note:
      return "note";
    case data::Severity::warning:
      return "warning";
    case data::Severity::error:
      return "error";
  }
  return "";
}

std::string role_name(const data::Experiment& e) {
  return e.role == data::Role::fit ? "fit" : "holdout";
}
std::string load_name(const data::Experiment& e) {
  return e.load == data::Load::free ? "free" : "locked";
}

void print(const data::Experiment& e, const data::RecordSummary& r, Console& console) {
  console.line(fmt::format("{}  {}", console.bold(e.name), console.dim(e.file.string())));
  console.line(fmt::format("  {} samples at {:.6g} Hz, {:.4g} s{}{}; load {}, role {}", r.samples, r.rate_hz,
                           r.duration_s, r.gaps > 0 ? fmt::format(", {} gaps", r.gaps) : "",
                           r.masked_percent > 0.0 ? fmt::format(", {:.2g} % masked", r.masked_percent) : "",
                           load_name(e), role_name(e)));
  if (r.highest_speed && !(*r.highest_speed > 0.0))
    console.line("  is at rest");
  else if (r.moving_percent)
    console.line(fmt::format("  moves {:.0f} % of the time, {} to {} {}, {} reversals{}", *r.moving_percent,
                             number(r.lowest_speed), number(r.highest_speed), r.speed_unit, *r.reversals,
                             r.period_s ? fmt::format("; repeats itself every {:.4g} s", *r.period_s) : ""));
  output::Table table({"signal", "from", "to", "noise", "step", "unit", ""}, "lrrrrll");
  for (const data::SignalSummary& s : r.signals)
    table.row({std::string(data::column_name(s.column)), number(s.low), number(s.high), number(s.noise_std),
               number(s.quantum), s.unit,
               s.stated_noise_std ? fmt::format("noise stated: {}", number(*s.stated_noise_std)) : ""});
  console.line(table.text(4));
  console.line();
}

json summary_json(const data::Experiment& e, const data::RecordSummary& r) {
  json signals = json::array();
  for (const data::SignalSummary& s : r.signals)
    signals.push_back({{"signal", data::column_name(s.column)},
                       {"unit", s.unit},
                       {"low", json_number(s.low)},
                       {"high", json_number(s.high)},
                       {"noise_std", json_number(s.noise_std)},
                       {"stated_noise_std", json_number(s.stated_noise_std)},
                       {"quantum", json_number(s.quantum)}});
  return {{"name", e.name},
          {"file", e.file.string()},
          {"role", role_name(e)},
          {"load", load_name(e)},
          {"samples", r.samples},
          {"rate_hz", json_number(r.rate_hz)},
          {"duration_s", json_number(r.duration_s)},
          {"gaps", r.gaps},
          {"masked_percent", json_number(r.masked_percent)},
          {"signals", std::move(signals)},
          {"moving_percent", json_number(r.moving_percent)},
          {"lowest_speed", json_number(r.lowest_speed)},
          {"highest_speed", json_number(r.highest_speed)},
          {"speed_unit", r.speed_unit},
          {"reversals", r.reversals ? json(*r.reversals) : json(nullptr)},
          {"period_s", json_number(r.period_s)},
          {"unused_columns", e.unused_columns}};
}

json findings_json(const std::vector<data::Finding>& findings) {
  json list = json::array();
  for (const data::Finding& f : findings)
    list.push_back({{"severity", severity_name(f.severity)},
                    {"kind", f.kind},
                    {"file", f.file},
                    {"line", f.line > 0 ? json(f.line) : json(nullptr)},
                    {"column", f.column},
                    {"what", f.what},
                    {"remedy", f.remedy}});
  return list;
}

void print(const std::vector<data::Finding>& findings, Console& console) {
  console.line(console.bold(findings.empty() ? "No problems were found." : "Findings"));
  for (const data::Finding& f : findings)
    console.line(output::wrapped(fmt::format("{} ({}): {}", severity_name(f.severity), f.kind, f.text()), 2, 2));
  console.line();
}

// Prints which filters an identification would use; null where these data allow none.
json print_pipeline(const data::Dataset& dataset, const project::BaseModel& base,
                    const estimation::PipelineOptions& options, Console& console) {
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : dataset.experiments) experiments.push_back(&e);
  try {
    console.progress("choosing the filters");
    const estimation::PreparedData prepared = estimation::prepare(experiments, base.model, options);
    console.line(output::wrapped(output::pipeline_text(prepared)));
    return {{"cutoff_hz", json_number(prepared.pipeline.row_cutoff_hz)},
            {"motion_cutoff_hz", json_number(prepared.pipeline.motion_cutoff_hz)},
            {"reason", prepared.pipeline.reason}};
  } catch (const data::DataError& error) {
    console.line(output::wrapped(fmt::format("No identification is possible: {}", error.what())));
    return nullptr;
  }
}

int run(const CheckOptions& options, Console& console) {
  console.progress("reading the measurements");
  const data::Dataset dataset = data::load(options.data.data, {options.data.tolerate, false});
  const data::Axis axis = dataset.drive.axis.value_or(data::Axis::rotary);
  json experiments = json::array();
  for (const data::Experiment& e : dataset.experiments) {
    console.progress(fmt::format("looking at {}", e.name));
    const data::RecordSummary summary = data::summary_of(e, axis);
    print(e, summary, console);
    experiments.push_back(summary_json(e, summary));
  }
  print(dataset.findings, console);

  const project::BaseModel base = project::base_model(dataset, "base");
  console.line(console.bold("What can be identified"));
  for (const std::string& reason : base.reasons) console.line(output::wrapped(reason));
  json pipeline = print_pipeline(dataset, base, options.pipeline.options(), console);
  output::save_json(options.json, {{"format", "flexspline-check/1"},
                                   {"axis", axis == data::Axis::rotary ? "rotary" : "linear"},
                                   {"gear_ratio", json_number(dataset.drive.gear_ratio)},
                                   {"torque_constant_nm_a", json_number(dataset.drive.torque_constant_nm_a)},
                                   {"experiments", std::move(experiments)},
                                   {"findings", findings_json(dataset.findings)},
                                   {"base_model", base.reasons},
                                   {"pipeline", std::move(pipeline)}});
  return kDone;
}

void declare(Parser& parser, CheckOptions& options) {
  take_data(parser, options.data);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command check_command() {
  return command<CheckOptions>(
      {"check",
       "what is in the data: signals, rates, noise, excitation, findings",
       "Reads measurements and lists what each experiment holds: signals with their range, noise and smallest "
       "step, motion, reversals, a period if it repeats itself; then each problem and its remedy, "
       "what can be identified from these signals, and which filters would be used.",
       {kMakeData, "flexspline check demo-out"}},
      declare, run);
}

}  // namespace flexspline::cli
