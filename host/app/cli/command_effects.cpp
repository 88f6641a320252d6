#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/effect_curve.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::cli {
namespace {

using catalogue::Entry;
using nlohmann::json;

struct EffectsOptions {
  std::string name;  // empty: all
  std::string json;
};

std::string kind_name(effects::Kind kind) {
  switch (kind) {
    case effects::Kind::linear:
      return "linear";
    case effects::Kind::nonlinear:
      return "shape";  // the word of flexspline-effects/1
    case effects::Kind::grid:
      return "grid";
    case effects::Kind::given:
      return "given";
  }
  return "";
}

std::string phase_name(effects::Phase phase) {
  switch (phase) {
    case effects::Phase::shift:
      return "shift";
    case effects::Phase::modulate:
      return "modulate";
    case effects::Phase::source:
      return "source";
  }
  return "";
}

std::string usual(const Entry& entry) {
  std::vector<std::string> values;
  for (const effects::ParameterInfo& p : entry.parameters)
    if (p.kind != effects::Kind::given) values.push_back(output::with_unit(p.usual, p.unit.rotary));
  return output::listed(values, "and");
}

json entry_json(const Entry& entry) {
  json parameters = json::array();
  for (const effects::ParameterInfo& p : entry.parameters)
    parameters.push_back({{"parameter", p.name},
                          {"symbol", p.symbol.empty() ? p.name : p.symbol},
                          {"unit", p.unit.rotary},
                          {"unit_linear", p.unit.linear},
                          {"kind", kind_name(p.kind)},
                          {"usual", output::json_number(p.usual)},
                          {"low", output::json_number(p.low)},
                          {"high", output::json_number(p.high)}});
  json confused = json::array();
  for (const std::string_view name : catalogue::confused_with(entry)) confused.push_back(name);
  return {{"name", entry.name()},
          {"number", entry.id},
          {"balance", catalogue::balance_name(entry.info->balance)},
          {"phase", phase_name(entry.info->phase)},
          {"equation", entry.info->equation},
          {"parameters", std::move(parameters)},
          {"shows_over", entry.info->shows_over},
          {"source", entry.info->source},
          {"explanation", entry.info->explanation},
          {"consequence", entry.info->consequence},
          {"causes", entry.info->causes},
          {"check", entry.info->check},
          {"separated_by", entry.info->separated_by},
          {"replaces", catalogue::split_names(entry.info->replaces)},
          {"modulates", entry.info->modulates},
          {"host_only", entry.info->host_only},
          {"rivals", std::move(confused)},
          {"curve", output::curve_json(output::effect_curve(entry))}};
}

std::string comma_separated(const std::vector<std::string_view>& names) {
  return output::listed(std::vector<std::string>(names.begin(), names.end()));
}

void describe(const Entry& entry, Console& console) {
  const effects::Description& info = *entry.info;
  console.line(console.bold(info.name));
  console.line(output::wrapped(info.explanation));
  console.line();
  console.line(
      output::wrapped(fmt::format("On the {} balance: {}", catalogue::balance_name(info.balance), info.equation)));
  output::Table table({"parameter", "", "unit", "(linear axis)", "", "usual"}, "lllllr");
  for (const effects::ParameterInfo& p : entry.parameters) {
    const char* how = p.kind == effects::Kind::linear      ? "estimated"
                      : p.kind == effects::Kind::nonlinear ? "estimated, a nonlinear parameter: searched for"
                      : p.kind == effects::Kind::grid
                          ? "set from the range of the data where the model does not state it"
                          : "stated by you";
    table.row({std::string(p.name), std::string(p.symbol), std::string(p.unit.rotary), std::string(p.unit.linear), how,
               output::number(p.usual)});
  }
  console.line(table.text_within(output::line_width()));
  if (const std::string rule = output::reference_rule(info.name); !rule.empty()) console.line(output::wrapped(rule));
  console.line();
  console.line(
      info.equation.find("wref") == std::string_view::npos
          ? "At these values:"
          : fmt::format("At these values, and wref = {}:", output::with_unit(output::kRatedVelocityOfCurves, "rad/s")));
  console.line(output::curve_text(output::effect_curve(entry), output::takes_braille()));
  console.line();
  const auto print = [&](std::string_view what, std::string_view text) {
    if (!text.empty()) console.line(output::wrapped(fmt::format("{}: {}", what, text)));
  };
  print("Shows over", info.shows_over);
  print("What it does", info.consequence);
  print("Usual causes", info.causes);
  print("Check on the machine", info.check);
  print("Confused with", comma_separated(catalogue::confused_with(entry)));
  print("Distinguished by", info.separated_by);
  print("Used instead of", comma_separated(catalogue::split_names(info.replaces)));
  print("Contains", comma_separated(catalogue::split_names(info.contains)));
  print("Left by a wrong phase of", comma_separated(catalogue::split_names(info.phase_error_of)));
  print("Scales", info.modulates);
  print("Source", info.source);
}

// A user-defined effect has no parameters of its own and no curve: the text explains how to define one instead.
constexpr std::string_view kMadeByUsers[] = {catalogue::kTableEffect, catalogue::kExpressionEffect};

std::string how_to_add(std::string_view name) {
  return name == catalogue::kTableEffect
             ? "flexspline add table_effect:velocity --model base-model.toml DATA --out better.toml"
             : "flexspline add expression_effect --formula 'a*tanh(velocity/b)' --parameter a:N*m --parameter "
               "b=0.1..50:rad/s --model base-model.toml DATA --out better.toml";
}

json user_defined_json(const effects::Description& info) {
  json confused = json::array();
  for (const std::string_view name : catalogue::split_names(info.confused_with)) confused.push_back(name);
  json signals = json::array();
  for (const effects::VariableInfo& v : effects::kVariables)
    signals.push_back({{"signal", v.name}, {"unit", v.unit.rotary}, {"unit_linear", v.unit.linear}});
  return {{"name", info.name},
          {"balance", nullptr},
          {"phase", phase_name(info.phase)},
          {"equation", info.equation},
          {"parameters", json::array()},
          {"shows_over", info.shows_over},
          {"source", info.source},
          {"explanation", info.explanation},
          {"causes", info.causes},
          {"separated_by", info.separated_by},
          {"rivals", std::move(confused)},
          {"signals", std::move(signals)},
          {"curve", nullptr}};
}

void describe_user_defined(const effects::Description& info, Console& console) {
  console.line(console.bold(info.name));
  console.line(output::wrapped(info.explanation));
  console.line();
  console.line(output::wrapped(fmt::format("On the balance that you choose: {}", info.equation)));
  output::Table table({"signal", "unit", "(linear axis)", ""}, "llll");
  for (const effects::VariableInfo& v : effects::kVariables)
    table.row({std::string(v.name), std::string(v.unit.rotary), std::string(v.unit.linear), std::string(v.meaning)});
  console.line(table.text_within(output::line_width()));
  if (info.name == catalogue::kExpressionEffect)
    console.line(output::wrapped(
        "direction, output_direction and torsion_direction are 1, -1, or 0 at rest. Functions: sin, cos, tan, tanh, "
        "exp, ln, sqrt, abs, sign, min, max; powers are written ^, conditions a > b ? c : d. Parameters that only "
        "scale the torque are estimated; others are searched for and need bounds."));
  console.line();
  console.line(output::wrapped(fmt::format("Usual causes, and what to check: {}", info.causes)));
  console.line(output::wrapped(fmt::format("Distinguished by: {}", info.separated_by)));
  console.line();
  console.line("  " + how_to_add(info.name));
}

int run(const EffectsOptions& options, Console& console) {
  json list = json::array();
  if (!options.name.empty()) {
    require_effect(options.name);
    const Entry* entry = catalogue::find(options.name);
    if (const effects::Description* made = catalogue::description_of(options.name)) {
      describe_user_defined(*made, console);
      output::save_json(options.json,
                        {{"format", "flexspline-effects/1"}, {"effects", json::array({user_defined_json(*made)})}});
      return kDone;
    }
    describe(*entry, console);
    list.push_back(entry_json(*entry));
  } else {
    output::Table table({"effect", "balance", "torque or change", "usual", "shows over"}, "lllll");
    for (const Entry& entry : catalogue::all()) {
      table.row({std::string(entry.name()), catalogue::balance_name(entry.info->balance),
                 std::string(entry.info->equation), usual(entry), std::string(entry.info->shows_over)});
      list.push_back(entry_json(entry));
    }
    for (const std::string_view name : kMadeByUsers) {
      const effects::Description& info = *catalogue::description_of(name);
      table.row({std::string(name), "yours", std::string(info.equation), "", std::string(info.shows_over)});
      list.push_back(user_defined_json(info));
    }
    console.line(table.text_within(output::line_width(), 0));
    console.line();
    console.line("flexspline effects NAME explains one.");
  }
  output::save_json(options.json, {{"format", "flexspline-effects/1"}, {"effects", std::move(list)}});
  return kDone;
}

void declare(Parser& parser, EffectsOptions& options) {
  parser.option("NAME", options.name, "the effect to explain").value("");
}

}  // namespace

Command effects_command() {
  return command<EffectsOptions>(
      {"effects",
       "the catalogue of physical effects, or one of them explained",
       "Without a name: all effects with the torque balance they act on, their equation, usual size and where they "
       "show. With a name: what the effect is, where it comes from on a machine, what it is confused with and which "
       "experiment distinguishes them; and a drawn curve.",
       {"flexspline effects stribeck_gaussian"}},
      declare, run);
}

}  // namespace flexspline::cli
