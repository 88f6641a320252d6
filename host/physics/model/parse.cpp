// From the tree of a model file to a model, with every mistake named by its line.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "host/common/text/nearest.hpp"
#include "host/input/data/keys.hpp"
#include "host/physics/model/document.hpp"
#include "host/physics/model/model.hpp"
#include "host/physics/model/text.hpp"
#include "host/physics/model/units.hpp"

namespace flexspline::model {
namespace {

constexpr std::string_view kFormat = "flexspline-model/1";
// What rounding to the digits of a written value can move it, relative to a bound.
constexpr double kRounding = 1e-5;
// Edits that a misspelt name may always be away from the one that is meant: two letters that changed places.
constexpr std::size_t kSlips = 2;

std::string join(const std::vector<std::string_view>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

// Everything in [drive] is a size, except the temperature.
Bounds drive_bounds(const DriveKey& key) {
  if (key.key == "temperature_reference_c") return {-273.15, 1000.0};
  if (key.is_count) return {1.0, data::kMostCounted};
  return {std::numeric_limits<double>::min(), std::numeric_limits<double>::max()};
}

class Reader {
 public:
  Reader(std::string_view file_name, const KnownEffects& known) : file_name_(file_name), known_(known) {}

  Model model(const Node& root) {
    format(root);
    for (const Entry& entry : root.entries)
      require_known(entry, "a model file", {"format", "name", "drive", "effect", "history"});
    Model result;
    if (const Node* name = root.find("name")) result.name = text(*name, "name");
    // First of all: the axis decides on the units.
    if (const Node* node = root.find("drive")) result.drive = drive(*node);
    axis_ = result.drive.axis;
    if (const Node* effects = root.find("effect"))
      for (const Node& node : tables(*effects, "effect")) result.effects.push_back(effect(node));
    if (const Node* histories = root.find("history"))
      for (const Node& node : tables(*histories, "history")) result.history.push_back(history(node));
    return result;
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& what, const std::string& remedy) const {
    throw ModelError(fmt::format("{}:{}: {}; {}", file_name_, line, what, remedy));
  }

  void require_known(const Entry& entry, const std::string& where, const std::vector<std::string_view>& known) const {
    if (std::ranges::find(known, entry.key) != known.end()) return;
    const std::string meant = text::nearest(entry.key, known, kSlips);
    fail(entry.line, fmt::format("{} has no key \"{}\"", where, entry.key),
         meant.empty() ? fmt::format("known are {}", join(known)) : fmt::format("did you mean \"{}\"?", meant));
  }

  void format(const Node& root) const {
    const Node* node = root.find("format");
    const std::string remedy = fmt::format("the file must have format = \"{}\" before its first table", kFormat);
    if (!node) fail(1, "this is not a model file: it has no format", remedy);
    if (node->kind != NodeKind::text || node->text != kFormat)
      fail(node->line,
           node->kind == NodeKind::text ? fmt::format("the format is \"{}\", which cannot be read", node->text)
                                        : fmt::format("format is {}", node->kind_name()),
           remedy);
  }

  std::string text(const Node& node, std::string_view key) const {
    if (node.kind != NodeKind::text)
      fail(node.line, fmt::format("{} is {}", key, node.kind_name()), "write a text in quotes");
    return node.text;
  }

  double number(const Node& node, std::string_view key) const {
    if (node.kind != NodeKind::number)
      fail(node.line, fmt::format("{} is {}, not a number", key, node.kind_name()),
           fmt::format("write a number without quotes and unit, such as {} = 12", key));
    if (!std::isfinite(node.number))
      fail(node.line, fmt::format("{} is {}", key, std::isnan(node.number) ? "NaN" : "infinite"),
           "write a finite number, or leave the key out where the value is not known");
    return node.number;
  }

  double number_within(const Node& node, std::string_view key, Bounds bounds) const {
    const double value = number(node, key);
    const auto slack = [](double bound) { return std::isfinite(bound) ? kRounding * std::abs(bound) : 0.0; };
    if (value < bounds.low - slack(bounds.low) || value > bounds.high + slack(bounds.high)) {
      const bool positive = bounds.low == std::numeric_limits<double>::min();
      fail(node.line, fmt::format("{} = {} is outside its bounds", key, exact_text(value)),
           positive ? "it must be greater than 0"
                    : fmt::format("it must be between {} and {}", bound_text(bounds.low), bound_text(bounds.high)));
    }
    return std::clamp(value, bounds.low, bounds.high);
  }

  static std::string bound_text(double bound) {
    return std::isfinite(bound) ? number_text(bound, kValueDigits) : bound < 0.0 ? "-infinity" : "infinity";
  }

  const std::vector<Node>& tables(const Node& node, std::string_view key) const {
    const bool good = node.kind == NodeKind::array && std::ranges::all_of(node.items, [](const Node& item) {
                        return item.kind == NodeKind::table && item.has_header;
                      });
    if (!good)
      fail(node.line,
           fmt::format("{} is {}", key, node.kind == NodeKind::array ? "an array of values" : node.kind_name()),
           fmt::format("begin each one with a line [[{}]]", key));
    return node.items;
  }

  Drive drive(const Node& node) const {
    if (node.kind != NodeKind::table)
      fail(node.line, fmt::format("drive is {}", node.kind_name()), "write a table that begins with the line [drive]");
    std::vector<std::string_view> keys = {"axis"};
    for (const DriveKey& key : kDriveKeys) keys.push_back(key.key);
    for (const Entry& entry : node.entries) require_known(entry, "[drive]", keys);
    Drive result;
    if (const Node* axis = node.find("axis")) {
      const std::string name = text(*axis, "axis");
      if (name != "rotary" && name != "linear")
        fail(axis->line, fmt::format("axis is \"{}\"", name), "write \"rotary\" or \"linear\"");
      result.axis = name == "linear" ? data::Axis::linear : data::Axis::rotary;
    }
    for (const DriveKey& key : kDriveKeys)
      if (const Node* value = node.find(key.key)) result.*key.quantity = quantity(*value, key);
    return result;
  }

  Quantity quantity(const Node& node, const DriveKey& fact) const {
    const std::string_view key = fact.key;
    Quantity result;
    const Node* value = &node;
    if (node.kind == NodeKind::table) {
      for (const Entry& entry : node.entries)
        require_known(entry, fmt::format("{} (its unit is in its name)", key), {"value", "source"});
      if (const Node* source = node.find("source")) result.source = text(*source, "source");
      value = node.find("value");
    }
    if (!value) return result;
    result.value = number_within(*value, key, drive_bounds(fact));
    if (fact.is_count && value->number != std::floor(value->number))
      fail(value->line, fmt::format("{} = {} is not a whole number", key, exact_text(value->number)),
           fmt::format("write how many the motor has, such as {} = 12, or leave the key out", key));
    return result;
  }

  Effect effect(const Node& node) {
    const Node* type = node.find("type");
    if (!type)
      fail(node.line, "the effect has no type", "write type = \"NAME\"; \"flexspline effects\" lists the names");
    Effect result;
    result.type = text(*type, "type");
    const KnownEffect* known = known_.find(result.type);
    if (!known) {
      const std::string meant = text::nearest_or_first_words(result.type, known_.names(), kSlips);
      fail(type->line, fmt::format("there is no effect \"{}\"", result.type),
           meant.empty() ? "\"flexspline effects\" lists the names" : fmt::format("did you mean \"{}\"?", meant));
    }
    for (const Entry& entry : node.entries) {
      const bool misplaced = std::ranges::any_of(known->parameters, [&](const auto& p) { return p.name == entry.key; });
      if (misplaced)
        fail(entry.line, fmt::format("the parameter {} is outside the parameters", entry.key),
             "write it below a line [effect.parameters]");
      require_known(entry, "[[effect]]", keys_of(known->form));
    }
    identify(node, result, type->line);
    if (known->form != Form::plain) {
      read_user_definition(node, *known, result);
      return result;
    }
    const Node* parameters = node.find("parameters");
    if (parameters && parameters->kind != NodeKind::table)
      fail(parameters->line, fmt::format("the parameters of {} are {}", result.id, parameters->kind_name()),
           "begin them with a line [effect.parameters], in single brackets");
    std::vector<std::string_view> names;
    for (const KnownParameter& parameter : known->parameters) names.push_back(parameter.name);
    if (parameters)
      for (const Entry& entry : parameters->entries) require_known(entry, result.type, names);
    for (const KnownParameter& parameter : known->parameters) {
      const Node* value = parameters ? parameters->find(parameter.name) : nullptr;
      result.parameters.push_back(this->parameter(value, parameter));
      if (parameter.given && !result.parameters.back().value)
        fail(value ? value->line : type->line,
             fmt::format("{} needs its {}, which is stated and never estimated", result.id, parameter.name),
             fmt::format("write {} = NUMBER below [effect.parameters]", parameter.name));
    }
    return result;
  }

  static std::vector<std::string_view> keys_of(Form form) {
    if (form == Form::table) return {"type", "id", "variable", "balance", "times_direction", "table"};
    if (form == Form::formula) return {"type", "id", "formula", "balance", "parameters"};
    return {"type", "id", "parameters"};
  }

  void read_user_definition(const Node& node, const KnownEffect& known, Effect& result) const {
    Definition definition;
    if (const Node* balance = node.find("balance")) {
      definition.balance = text(*balance, "balance");
      if (definition.balance != "motor" && definition.balance != "transmission" && definition.balance != "load")
        fail(balance->line, fmt::format("there is no balance \"{}\"", definition.balance),
             "write \"motor\", \"transmission\" or \"load\"");
    }
    const std::string_view key = known.form == Form::table ? "variable" : "formula";
    const Node* what = node.find(key);
    if (!what)
      fail(node.line, fmt::format("{} has no {}", result.id, key),
           known.form == Form::table ? "write variable = \"velocity\", for example"
                                     : "write formula = \"a*tanh(velocity/b)\", for example");
    (known.form == Form::table ? definition.variable : definition.formula) = text(*what, key);
    if (const Node* times = node.find("times_direction")) {
      if (times->kind != NodeKind::boolean)
        fail(times->line, fmt::format("times_direction is {}", times->kind_name()), "write true or false");
      definition.times_direction = times->boolean;
    }
    if (const Node* table = node.find("table")) definition.table = this->table(*table);
    result.definition = std::move(definition);
    const Node* parameters = node.find("parameters");
    if (parameters && parameters->kind != NodeKind::table)
      fail(parameters->line, fmt::format("the parameters of {} are {}", result.id, parameters->kind_name()),
           "begin them with a line [effect.parameters], in single brackets");
    if (parameters)
      for (const Entry& entry : parameters->entries) result.parameters.push_back(own_parameter(entry));
    if (const auto objection = known_.objection(result)) {
      const Node* at = node.find(objection->key);
      if (!at && parameters) at = parameters->find(objection->key);
      fail(at ? at->line : node.line, objection->what, objection->remedy);
    }
  }

  Table table(const Node& node) const {
    if (node.kind != NodeKind::table)
      fail(node.line, fmt::format("table is {}", node.kind_name()), "begin it with a line [effect.table]");
    Table result;
    for (const Entry& entry : node.entries) require_known(entry, "[effect.table]", {"at", "value", "std", "fixed"});
    for (const auto& [key, place] : {std::pair{"at", &Table::at}, {"value", &Table::value}, {"std", &Table::std}})
      if (const Node* list = node.find(key)) result.*place = numbers(*list, key);
    if (const Node* fixed = node.find("fixed")) {
      if (fixed->kind != NodeKind::boolean)
        fail(fixed->line, fmt::format("fixed is {}", fixed->kind_name()), "write true or false without quotes");
      result.fixed = fixed->boolean;
    }
    for (const auto& [key, size] : {std::pair{"value", result.value.size()}, {"std", result.std.size()}})
      if (size != 0 && size != result.at.size())
        fail(node.find(key)->line, fmt::format("{} has {} numbers, and at has {}", key, size, result.at.size()),
             "give one for each point");
    return result;
  }

  std::vector<double> numbers(const Node& node, std::string_view key) const {
    if (node.kind != NodeKind::array)
      fail(node.line, fmt::format("{} is {}", key, node.kind_name()), fmt::format("write {} = [1.0, 2.0]", key));
    std::vector<double> result;
    for (const Node& item : node.items) result.push_back(number(item, key));
    return result;
  }

  // A parameter of a formula: the user gives what the catalogue gives of others.
  Parameter own_parameter(const Entry& entry) const {
    const Node& node = entry.value;
    KnownParameter known{
        entry.key, "-", "-", -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), false};
    std::optional<double> low, high;
    if (node.kind == NodeKind::table) {
      if (const Node* unit = node.find("unit")) known.unit_rotary = known.unit_linear = text(*unit, "unit");
      if (const Node* bound = node.find("low")) low = number(*bound, "low");
      if (const Node* bound = node.find("high")) high = number(*bound, "high");
      if (low && high && !(*low < *high))
        fail(node.line, fmt::format("low of {} is not below its high", entry.key), "write the smaller one as low");
    }
    known.low = low.value_or(known.low);
    known.high = high.value_or(known.high);
    Parameter result = parameter(&node, known, true);
    result.low = low;
    result.high = high;
    return result;
  }

  void identify(const Node& node, Effect& result, std::size_t type_line) {
    const Node* id = node.find("id");
    result.id = id ? text(*id, "id") : result.type;
    const std::size_t line = id ? id->line : type_line;
    const auto plain = [](unsigned char c) { return c > ' ' && c != '"' && c != 0x7F; };
    if (result.id.empty() || !std::ranges::all_of(result.id, plain))
      fail(line, fmt::format("the id \"{}\" cannot be used", result.id), "write a name without spaces and quotes");
    const auto [first, is_new] = lines_of_ids_.emplace(result.id, line);
    if (!is_new)
      fail(line, fmt::format("a second effect is named \"{}\", the first one on line {}", result.id, first->second),
           "give one of them another id = \"NAME\"");
  }

  Parameter parameter(const Node* node, const KnownParameter& known, bool own = false) const {
    Parameter result;
    result.name = known.name;
    result.unit = axis_ == data::Axis::linear ? known.unit_linear : known.unit_rotary;
    if (!node) return result;
    const Node* value = node;
    if (node->kind == NodeKind::table) {
      std::vector<std::string_view> keys = {"value", "unit", "std", "spread_percent", "fixed"};
      if (own) keys.insert(keys.end(), {"low", "high"});
      for (const Entry& entry : node->entries) require_known(entry, result.name, keys);
      if (const Node* unit = node->find("unit")) require_unit(*unit, result);
      if (const Node* deviation = node->find("std")) {
        result.std = number(*deviation, "std");
        if (*result.std < 0.0)
          fail(deviation->line, fmt::format("std = {} is negative", exact_text(*result.std)),
               "write a standard deviation of 0 or more, or leave it out");
      }
      if (const Node* spread = node->find("spread_percent")) result.spread_percent = number(*spread, "spread_percent");
      if (const Node* fixed = node->find("fixed")) {
        if (fixed->kind != NodeKind::boolean)
          fail(fixed->line, fmt::format("fixed is {}", fixed->kind_name()), "write true or false without quotes");
        result.fixed = fixed->boolean;
      }
      value = node->find("value");
    }
    if (value) result.value = number_within(*value, known.name, {known.low, known.high});
    if (result.fixed && !result.value)
      fail(node->line, fmt::format("{} is fixed, but has no value", result.name),
           "write value = NUMBER next to it, or leave out fixed to have it estimated");
    return result;
  }

  void require_unit(const Node& node, const Parameter& parameter) const {
    const std::string unit = text(node, "unit");
    if (same_unit(unit, parameter.unit)) return;
    const bool none = is_dimensionless(parameter.unit);
    fail(node.line,
         fmt::format("the unit of {} is \"{}\", but {} is expected", parameter.name, unit,
                     none ? "none" : fmt::format("\"{}\"", parameter.unit)),
         none ? "convert the value to a plain number and leave the unit out"
              : fmt::format("convert the value and write unit = \"{}\"", parameter.unit));
  }

  History history(const Node& node) const {
    for (const Entry& entry : node.entries)
      require_known(entry, "[[history]]", {"action", "effect", "rmse_before", "rmse_after"});
    History result;
    for (const auto& [key, place] : {std::pair{"action", &History::action}, std::pair{"effect", &History::effect}}) {
      const Node* value = node.find(key);
      if (!value) fail(node.line, fmt::format("the history has no {}", key), fmt::format("write {} = \"NAME\"", key));
      result.*place = text(*value, key);
    }
    if (const Node* before = node.find("rmse_before")) result.rmse_before = number(*before, "rmse_before");
    if (const Node* after = node.find("rmse_after")) result.rmse_after = number(*after, "rmse_after");
    return result;
  }

  std::string_view file_name_;
  const KnownEffects& known_;
  data::Axis axis_ = data::Axis::rotary;
  std::map<std::string, std::size_t> lines_of_ids_;
};

}  // namespace

const Parameter* Effect::find(std::string_view name) const {
  const auto found = std::ranges::find(parameters, name, &Parameter::name);
  return found == parameters.end() ? nullptr : &*found;
}

Parameter* Effect::find(std::string_view name) {
  return const_cast<Parameter*>(std::as_const(*this).find(name));
}

const Effect* Model::find(std::string_view id) const {
  const auto found = std::ranges::find(effects, id, &Effect::id);
  return found == effects.end() ? nullptr : &*found;
}

Effect* Model::find(std::string_view id) {
  return const_cast<Effect*>(std::as_const(*this).find(id));
}

ModelFile parse(std::string text, std::string_view file_name, const KnownEffects& known) {
  Model model = Reader(file_name, known).model(parse_document(text, file_name));
  return {std::move(model), std::move(text)};
}

}  // namespace flexspline::model
