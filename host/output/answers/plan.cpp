#include "host/output/answers/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;
using planning::Design;
using planning::Mode;
using planning::Run;

std::string frequency_of(const Run& run) {
  if (run.mode == Mode::off || run.frequency_hz == 0.0) return "";
  if (run.end_frequency_hz) return fmt::format("{:g} to {:g} Hz", run.frequency_hz, *run.end_frequency_hz);
  return fmt::format("{:g} Hz", run.frequency_hz);
}

std::string_view torque_unit_of(const Design& design) {
  return catalogue::unit_on(effects::units::kTorque, design.axis);
}
std::string_view effort_unit(const Design& design) {
  return design.effort_is_current ? "A" : torque_unit_of(design);
}
std::string_view effort_name(const Design& design) {
  return design.effort_is_current ? "current" : design.axis == data::Axis::linear ? "force" : "torque";
}

// Of what a run's set point is in, on an axis that turns or moves straight.
std::string_view unit_of(const Run& run, const Design& design) {
  if (run.mode == Mode::current) return effort_unit(design);
  const data::Axis axis = design.axis;
  return catalogue::unit_on(run.mode == Mode::position ? effects::units::kAngle : effects::units::kVelocity, axis);
}

std::string amplitude_of(const Run& run, const Design& design) {
  if (run.mode == Mode::off) return "";
  return fmt::format("{} {}", number(run.amplitude, 3), unit_of(run, design));
}

std::string motion_of(const Run& run, const Design& design) {
  if (run.mode == Mode::off) return "power off";
  return fmt::format("{} of {}", run.end_frequency_hz ? "chirp" : planning::name_of(run.waveform),
                     run.mode == Mode::current ? effort_name(design) : planning::name_of(run.mode));
}

std::string percent(const std::optional<double>& value) {
  if (!value) return "unknown";
  return *value < 0.01    ? "< 0.01 %"
         : *value < 100.0 ? fmt::format("{:.2g} %", *value)
                          : fmt::format("{:.0f} %", *value);
}

void print_runs(Console& console, const Design& design) {
  Table table({"run", "motion", "amplitude", "frequency", "lasts", "load", fmt::format("peak {}", effort_name(design)),
               "velocity", "travel"},
              "lllllll");
  for (std::size_t i = 0; i < design.plan.runs.size(); ++i) {
    const Run& run = design.plan.runs[i];
    const Design::Peak& peak = design.peaks[i];
    const std::string load = run.locked ? "locked"
                             : run.load_torque_nm != 0.0
                                 ? fmt::format("{:+.3g} {}", run.load_torque_nm, torque_unit_of(design))
                                 : "free";
    table.row(
        {run.name, motion_of(run, design), amplitude_of(run, design), frequency_of(run),
         fmt::format("{:g} s", run.duration_s), load,
         fmt::format("{} {}", number(peak.current_a, 3), effort_unit(design)),
         fmt::format("{} {}", number(peak.velocity_rad_s, 3),
                     catalogue::unit_on(effects::units::kVelocity, design.axis)),
         fmt::format("{} {}", number(peak.travel_rad, 3), catalogue::unit_on(effects::units::kAngle, design.axis))});
  }
  console.line(table.text());
  std::vector<std::string> printed;
  for (const Run& run : design.plan.runs) {
    if (run.instructions.empty() || std::find(printed.begin(), printed.end(), run.instructions) != printed.end())
      continue;
    printed.push_back(run.instructions);
    console.line(wrapped(fmt::format("{}: {}", run.name, run.instructions)));
  }
}

json separation_json(const std::optional<planning::Separation>& s) {
  if (!s) return nullptr;
  return {{"of_first", json_number(s->of_first)},
          {"of_second", json_number(s->of_second)},
          {"worst", json_number(s->worst())}};
}

}  // namespace

void print_plan(Console& console, const Design& design, const std::string& file) {
  const bool separating = !design.plan.separate.empty();
  const bool useless = separating && design.after && design.after->worst() < planning::kDistinguished;
  if (separating)
    console.line(
        console.bold(fmt::format("To distinguish {} from {}", design.plan.separate[0], design.plan.separate[1])));
  else
    console.line(console.bold("To determine the parameters"));
  for (const std::string& note : design.plan.notes) console.line(wrapped(note));
  const bool known = std::all_of(design.parameters.begin(), design.parameters.end(),
                                 [](const planning::Precision& p) { return p.precise(); });
  if (design.plan.runs.empty() && !useless && (separating || known))
    console.line(wrapped(separating ? "What was recorded distinguishes them already."
                                    : fmt::format("All parameters are known well: relative standard deviations are "
                                                  "below {:g} %.",
                                                  planning::kPrecisePercent)));
  if (!design.plan.runs.empty()) {
    console.line();
    print_runs(console, design);
  }
  if (!design.parameters.empty()) {
    Table table({"parameter", "value", "", "relative std now", "expected"}, "lrlrr");
    for (const planning::Precision& p : design.parameters)
      table.row({fmt::format("{}.{}", p.id, p.parameter), number(p.value), p.unit == "1" ? "" : p.unit,
                 percent(p.percent_before), percent(p.percent_after)});
    console.line();
    console.line(table.text());
  }
  if (design.plan.runs.empty()) return;
  console.line();
  console.line(fmt::format("{} holds the plan. On the twin:", file));
  console.line(fmt::format("  flexspline-hil record --plan {} --out planned", file));
}

json plan_json(const Design& design) {
  json runs = json::array();
  for (std::size_t i = 0; i < design.plan.runs.size(); ++i) {
    const Run& run = design.plan.runs[i];
    runs.push_back(
        {{"name", run.name},
         {"mode", planning::name_of(run.mode)},
         {"waveform", planning::name_of(run.waveform)},
         {"amplitude", json_number(run.amplitude)},
         {"unit", unit_of(run, design)},
         {"offset", json_number(run.offset)},
         {"frequency_hz", json_number(run.frequency_hz)},
         {"end_frequency_hz", json_number(run.end_frequency_hz)},
         {"duration_s", json_number(run.duration_s)},
         {"load", run.locked ? "locked" : "free"},
         {"load_torque_nm", json_number(run.load_torque_nm)},
         {"temperature_c", json_number(run.temperature_c)},
         {"instructions", run.instructions},
         {"peak_current_a", design.effort_is_current ? json_number(design.peaks[i].current_a) : json(nullptr)},
         {"peak_effort", json_number(design.peaks[i].current_a)},
         {"effort_unit", effort_unit(design)},
         {"peak_velocity_rad_s", json_number(design.peaks[i].velocity_rad_s)},
         {"travel_rad", json_number(design.peaks[i].travel_rad)}});
  }
  json parameters = json::array();
  for (const planning::Precision& p : design.parameters)
    parameters.push_back({{"id", p.id},
                          {"parameter", p.parameter},
                          {"value", json_number(p.value)},
                          {"unit", p.unit},
                          {"percent_before", json_number(p.percent_before)},
                          {"percent_after", json_number(p.percent_after)}});
  const bool separating = !design.plan.separate.empty();
  return {{"format", "flexspline-plan-answer/1"},
          {"separate", design.plan.separate},
          {"separable",
           separating ? json(design.after && design.after->worst() >= planning::kDistinguished) : json(nullptr)},
          {"margin_needed", json_number(planning::kDistinguished)},
          {"before", separation_json(design.before)},
          {"after", separation_json(design.after)},
          {"parameters", std::move(parameters)},
          {"runs", std::move(runs)},
          {"notes", design.plan.notes},
          {"warnings", design.warnings}};
}

}  // namespace flexspline::output
