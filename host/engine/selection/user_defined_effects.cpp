#include "host/engine/selection/user_defined_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "host/common/text/nearest.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::selection {
namespace {

constexpr std::string_view kTimesDirection = "*direction";

std::string free_id(std::string wanted, const model::Model& model) {
  std::string id = wanted;
  for (int k = 2; model.find(id); ++k) id = fmt::format("{}_{}", wanted, k);
  return id;
}

// Signals of the flexspline belong to its balance, those of the output to the load's.
std::string balance_for(unsigned reads) {
  if (reads & effects::kTorsion) return "transmission";
  if ((reads & effects::kOutputMotion) && !(reads & effects::kMotorMotion)) return "load";
  return "motor";
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

model::Effect table(std::string_view text, const UserDefinition& given, const model::Model& model) {
  if (!given.formula.empty() || !given.parameters.empty())
    throw model::ModelError("a table has no formula and no parameters; give them with expression_effect");
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos)
    throw model::ModelError(
        fmt::format("{0} needs the signal that it runs over; write {0}:velocity, for example; "
                    "signals are {1}",
                    text, catalogue::variable_names()));
  std::string_view rest = text.substr(colon + 1);
  model::Definition definition;
  definition.times_direction = rest.ends_with(kTimesDirection);
  if (definition.times_direction) rest.remove_suffix(kTimesDirection.size());
  const effects::VariableInfo* variable = catalogue::find_variable(rest);
  if (!variable) {
    std::vector<std::string_view> names;
    for (const effects::VariableInfo& v : effects::kVariables) names.push_back(v.name);
    const std::string meant = text::nearest(rest, names);
    throw model::ModelError(fmt::format("there is no signal \"{}\"; {}", rest,
                                        meant.empty() ? fmt::format("signals are {}", catalogue::variable_names())
                                                      : fmt::format("did you mean {}?", meant)));
  }
  if (given.points && (*given.points < 4 || *given.points > catalogue::kMostPoints))
    throw model::ModelError(fmt::format("{} points are too {}; a table has 4 to {}", *given.points,
                                        *given.points < 4 ? "few" : "many", catalogue::kMostPoints));
  if (variable->variable == effects::Variable::output_angle && model.drive.axis == data::Axis::linear)
    throw model::ModelError("a linear axis has no output angle");
  if (variable->variable == effects::Variable::motor_angle && model.drive.axis == data::Axis::linear &&
      !model.drive.pitch_m.value)
    throw model::ModelError("a turn of the motor is not known on this linear axis; write pitch_m into [drive]");
  definition.variable = std::string(rest);
  definition.balance = given.balance.empty() ? balance_for(variable->reads) : given.balance;
  model::Effect effect;
  effect.type = std::string(catalogue::kTableEffect);
  effect.id = free_id(fmt::format("table_{}{}", rest, definition.times_direction ? "_direction" : ""), model);
  effect.definition = std::move(definition);
  return effect;
}

model::Effect formula(std::string_view text, const UserDefinition& given, const model::Model& model) {
  if (text.size() != catalogue::kExpressionEffect.size())
    throw model::ModelError(
        fmt::format("{} takes its formula apart: add {} --formula 'a*tanh(velocity/b)' --parameter a:N*m --parameter "
                    "b=0.1..50:rad/s",
                    catalogue::kExpressionEffect, catalogue::kExpressionEffect));
  if (given.formula.empty())
    throw model::ModelError(
        fmt::format("{} needs --formula, such as --formula 'a*tanh(velocity/b)' --parameter a:N*m --parameter "
                    "b=0.1..50:rad/s",
                    text));
  if (given.points) throw model::ModelError("a formula has no points; leave out --points");
  model::Effect effect;
  effect.type = std::string(catalogue::kExpressionEffect);
  effect.id = free_id(effect.type, model);
  for (const std::string& parameter : given.parameters) {
    effect.parameters.push_back(parse_parameter(parameter));
    const auto same = [&](const model::Parameter& p) { return p.name == effect.parameters.back().name; };
    if (std::any_of(effect.parameters.begin(), effect.parameters.end() - 1, same))
      throw model::ModelError(fmt::format("the parameter {} is given twice", effect.parameters.back().name));
  }
  model::Definition definition;
  definition.formula = given.formula;
  definition.balance = given.balance.empty() ? "motor" : given.balance;
  effect.definition = std::move(definition);
  if (const auto objection = catalogue::objection_to(effect))
    throw model::ModelError(fmt::format("{}; {}", objection->what, objection->remedy));
  if (given.balance.empty()) effect.definition->balance = balance_for(catalogue::entry_of(effect).info->reads);
  return effect;
}

}  // namespace

bool names_user_defined_effect(std::string_view text) {
  return catalogue::description_of(text.substr(0, text.find(':'))) != nullptr;
}

model::Parameter parse_parameter(std::string_view text) {
  const auto refuse = [&](std::string_view what) {
    throw model::ModelError(fmt::format(
        "\"{}\" is not a parameter: {}; write NAME, NAME:UNIT or NAME=LOW..HIGH:UNIT, as in b=0.1..50:rad/s", text,
        what));
  };
  model::Parameter parameter;
  const std::size_t equals = text.find('='), colon = text.find(':');
  parameter.name = std::string(text.substr(0, std::min(equals, colon)));
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (parameter.name.empty() || (parameter.name[0] >= '0' && parameter.name[0] <= '9') ||
      !std::all_of(parameter.name.begin(), parameter.name.end(), is_plain))
    refuse("its name must be letters, digits and _");
  parameter.unit = colon == std::string_view::npos ? "1" : std::string(text.substr(colon + 1));
  if (equals == std::string_view::npos) return parameter;
  const std::string_view range = text.substr(equals + 1, colon == std::string_view::npos ? colon : colon - equals - 1);
  const std::size_t dots = range.find("..");
  if (dots == std::string_view::npos) refuse("its bounds need two dots between them");
  const auto bound = [&](std::string_view part) -> std::optional<double> {
    if (part.empty()) return std::nullopt;
    const auto value = number(part);
    if (!value) refuse("a bound is not a number");
    return value;
  };
  parameter.low = bound(range.substr(0, dots));
  parameter.high = bound(range.substr(dots + 2));
  if (parameter.low && parameter.high && !(*parameter.low < *parameter.high)) refuse("its bounds are no range");
  return parameter;
}

model::Effect user_defined_effect(std::string_view text, const UserDefinition& given, const model::Model& model) {
  const std::string_view name = text.substr(0, text.find(':'));
  if (!given.balance.empty() && given.balance != "motor" && given.balance != "transmission" && given.balance != "load")
    throw model::ModelError(
        fmt::format("there is no balance \"{}\"; it is motor, transmission or load", given.balance));
  return name == catalogue::kTableEffect ? table(text, given, model) : formula(text, given, model);
}

estimation::LearnedTable learn(estimation::Identification& base, const model::Effect& table,
                               const UserDefinition& given) {
  estimation::TableSpecification specification = estimation::table_specification(*table.definition);
  if (given.points) {
    specification.most_points = *given.points;
    specification.exactly = true;
  }
  const auto fail = [&](const char* kind, std::string what, std::string remedy) {
    throw data::DataError({{data::Severity::error, kind, "", 0, "", std::move(what), std::move(remedy)}});
  };
  const estimation::Balance on =
      base.prepared.output_signals.torque ? specification.balance : estimation::Balance::motor;
  const std::string& variable = table.definition->variable;
  for (std::size_t b = 0; b < base.data.size(); ++b) {
    if (base.data[b].balance() != on) continue;
    auto learned = estimation::learn_table(base.data[b], base.terms, specification, base.fits[b].root_weights);
    if (!learned)
      fail("missing_column",
           fmt::format("{} does not vary in these data, so that nothing can be learnt over it", variable),
           "record motion over the range that the table is to have, with the sensors that show it");
    if (learned->score < kPolicy.table_score || learned->decrease_percent < kPolicy.least_table_percent)
      fail("no_gain",
           fmt::format("a table over {} hardly lowers the error on samples that its fit did not see: by {:.2f} % "
                       "(score {:.0f}, {:.0f} is needed)",
                       variable, learned->decrease_percent, learned->score, kPolicy.table_score),
           "`flexspline diagnose` shows what the rest depends on; the model is left as it is");
    return std::move(*learned);
  }
  fail("missing_column", fmt::format("the {} balance cannot be formed from these data", table.definition->balance),
       "record the torque sensor, or put the table on the motor balance: --balance motor");
  return {};
}

}  // namespace flexspline::selection
