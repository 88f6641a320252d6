// Changes a model file in place. The text is brought to the wanted model in rounds: each reads the text, makes
// the edits that do not touch one another, and the last one finds nothing left to do. So no edit must know what another
// does to positions.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <stdexcept>
#include <utility>

#include "host/physics/model/edits.hpp"
#include "host/physics/model/same.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::model {
namespace {

// A key that a table is to have: its text, or none where it is not to be there; and whether what is there may
// stay.
struct Field {
  std::string key;
  std::optional<std::string> text;
  std::function<bool(const Node&)> stays;
};

bool reads(const Node& node, double value, const std::string& text) {
  double written = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), written);
  return node.kind == NodeKind::number && (node.number == value || node.number == written);
}

Field number_field(std::string key, const std::optional<double>& value, const std::string& text) {
  if (!value) return {std::move(key), std::nullopt, [](const Node&) { return false; }};
  return {std::move(key), text, [v = *value, text](const Node& node) { return reads(node, v, text); }};
}

Field deviation_field(std::string key, const std::optional<double>& value) {
  return number_field(std::move(key), value, value ? number_text(*value, kDeviationDigits) : "");
}

Field text_field(std::string key, const std::string& text) {
  if (text.empty()) return {std::move(key), std::nullopt, [](const Node& node) { return node.text.empty(); }};
  return {std::move(key), toml_string(text), [text](const Node& node) { return node.text == text; }};
}

std::vector<Field> fields_of(const Parameter& parameter) {
  const bool fixed = parameter.fixed;
  const auto bound = [](const char* key, const std::optional<double>& value) {
    return number_field(key, value, value ? exact_text(*value) : "");
  };
  return {number_field("value", parameter.value, parameter.value ? value_text(parameter) : ""),
          deviation_field("std", parameter.std), deviation_field("spread_percent", parameter.spread_percent),
          // A parameter that is not marked in the file is not fixed.
          Field{"fixed", fixed ? std::optional<std::string>("true") : std::nullopt,
                [fixed](const Node& node) { return node.boolean == fixed; }},
          bound("low", parameter.low), bound("high", parameter.high)};
}

Field flag_field(std::string key, bool flag) {
  return {std::move(key), flag ? std::optional<std::string>("true") : std::nullopt,
          [flag](const Node& node) { return node.boolean == flag; }};
}

// A list whose numbers are replaced one by one where there are as many of them, so that comments between them stay.
struct List {
  const char* key;
  const std::vector<double>* values;
  int digits;
};

// The order of the keys in a table that we extend.
constexpr std::string_view kOrder[] = {
    "format",          "name", "type",  "id",   "variable", "formula", "balance",
    "times_direction", "at",   "value", "unit", "std",      "source",  "spread_percent",
    "fixed",           "low",  "high"};

class Round {
 public:
  explicit Round(const std::string& text) : document_(text), edits_(document_) {}

  // The text after the round; nothing where there is nothing to do.
  std::optional<std::string> run(const Model& model) {
    cut(model);
    if (!edits_.empty()) return edits_.apply();
    sync(document_.root(), {text_field("name", model.name)});
    drive(model.drive);
    std::string added;
    for (const Effect& effect : model.effects) {
      const Node* node = document_.effect(effect.id);
      if (node)
        this->effect(*node, effect);
      else
        added += effect_block(effect, document_.newline()) + std::string(document_.newline());
    }
    // One kind a round: both may go to the end of the text.
    if (!added.empty())
      edits_.insert_blocks(document_.end_of_effects(), std::move(added));
    else
      histories(model);
    if (edits_.empty()) return std::nullopt;
    return edits_.apply();
  }

 private:
  void cut(const Model& model) {
    for (const std::string& id : document_.effect_ids()) {
      const Effect* effect = model.find(id);
      const Node* type = document_.effect(id)->find("type");
      if (!effect || !type || effect->type != type->text) edits_.cut_effect(id);
    }
  }

  void histories(const Model& model) {
    std::string added;
    for (std::size_t i = document_.history_count(); i < model.history.size(); ++i)
      added += history_block(model.history[i], document_.newline()) + std::string(document_.newline());
    if (!added.empty()) edits_.insert_blocks(document_.end_of_history(), std::move(added));
  }

  // Brings the keys of a table of the text to the fields; at most one insertion or removal a round.
  bool sync(const Node& table, const std::vector<Field>& fields) {
    bool structural = false;
    for (const Field& field : fields) {
      const Node* node = table.find(field.key);
      if (node && field.stays(*node)) continue;
      if (node && field.text) {
        edits_.replace(node->span, *field.text);
      } else if (!structural && (node || field.text)) {
        structural = true;
        if (node)
          edits_.remove_entry(table, field.key);
        else
          edits_.insert_entry(table, field.key, *field.text, kOrder);
      }
    }
    return structural;
  }

  void drive(const Drive& drive) {
    const Node* table = document_.root().find("drive");
    const bool linear = drive.axis == data::Axis::linear;
    if (!table) {
      const bool empty = std::ranges::all_of(kDriveKeys, [&](const DriveKey& key) {
        return !(drive.*key.quantity).value && (drive.*key.quantity).source.empty();
      });
      if (linear || !empty)
        edits_.insert_blocks(document_.end_of_root(),
                             fmt::format("[drive]{0}axis = \"{1}\"{0}{0}", document_.newline(), axis_name(drive.axis)));
      return;
    }
    const Node* axis = table->find("axis");
    const std::string name(axis_name(drive.axis));
    if (axis && axis->text != name) edits_.replace(axis->span, toml_string(name));
    bool structural = !axis && linear;
    if (structural) edits_.insert_entry(*table, "axis", toml_string(name), kOrder);
    for (const DriveKey& key : kDriveKeys) {
      const Quantity& quantity = drive.*key.quantity;
      const Node* node = table->find(key.key);
      const Field value =
          number_field("value", quantity.value, quantity.value ? exact_text(*quantity.value) : std::string());
      if (node && node->kind == NodeKind::table) {
        sync(*node, {value, text_field("source", quantity.source)});
      } else if (node && quantity.value) {
        if (!quantity.source.empty() || !value.stays(*node)) {
          edits_.replace(node->span, quantity_text(quantity));
        }
      } else if (!structural && (node || quantity.value || !quantity.source.empty())) {
        structural = true;
        if (node)
          edits_.remove_entry(*table, key.key);
        else
          edits_.insert_entry(*table, key.key, quantity_text(quantity), kOrder);
      }
    }
  }

  void effect(const Node& node, const Effect& effect) {
    const Node* parameters = node.find("parameters");
    bool structural = effect.definition && definition(node, *effect.definition);
    for (const Parameter& parameter : effect.parameters) {
      const Node* is_present = parameters ? parameters->find(parameter.name) : nullptr;
      const std::vector<Field> fields = fields_of(parameter);
      if (is_present && is_present->kind == NodeKind::table) {
        sync(*is_present, fields);
      } else if (is_present && is_stated(parameter)) {
        replace_number(*is_present, parameter, fields);
      } else if (!structural && (is_present || is_stated(parameter))) {
        structural = true;
        if (is_present)
          edits_.remove_entry(*parameters, parameter.name);
        else
          edits_.insert_parameter(node, parameter.name, parameter_text(parameter), parameter_order(effect));
      }
    }
  }

  bool definition(const Node& node, const Definition& definition) {
    std::vector<Field> fields = {text_field("variable", definition.variable), text_field("formula", definition.formula),
                                 flag_field("times_direction", definition.times_direction)};
    // An effect without a balance in the file is on the motor balance.
    if (node.find("balance") || definition.balance != "motor")
      fields.push_back(text_field("balance", definition.balance));
    if (sync(node, fields)) return true;
    const Table& table = definition.table;
    const Node* is_present = node.find("table");
    if (!is_present && table.at.empty()) return false;
    if (!is_present) {
      edits_.insert_blocks(document_.end_of_effect(node), table_block(table, document_.newline()));
      return true;
    }
    for (const List& list : {List{"at", &table.at, kPointDigits}, List{"value", &table.value, kValueDigits},
                             List{"std", &table.std, kDeviationDigits}})
      if (this->list(*is_present, list)) return true;
    return sync(*is_present, {flag_field("fixed", table.fixed)});
  }

  // True where an entry had to be added or taken out.
  bool list(const Node& table, const List& list) {
    const Node* is_present = table.find(list.key);
    if (!is_present && list.values->empty()) return false;
    if (!is_present || list.values->empty()) {
      if (is_present)
        edits_.remove_entry(table, list.key);
      else
        edits_.insert_entry(table, list.key, list_text(*list.values, list.digits, document_.newline()), kOrder);
      return true;
    }
    if (is_present->items.size() != list.values->size()) {
      edits_.replace(is_present->span, list_text(*list.values, list.digits, document_.newline()));
      return false;
    }
    for (std::size_t k = 0; k < list.values->size(); ++k) {
      const double value = (*list.values)[k];
      const std::string text = number_text(value, list.digits);
      if (!reads(is_present->items[k], value, text)) edits_.replace(is_present->items[k].span, text);
    }
    return false;
  }

  // A number that gets more fields becomes a table in braces, in which a number that does not change keeps its text.
  void replace_number(const Node& node, const Parameter& parameter, const std::vector<Field>& fields) {
    const bool stays = parameter.value && fields.front().stays(node);
    const bool more = parameter.std || parameter.spread_percent || parameter.fixed || !parameter.value;
    if (stays && !more) return;
    std::string text = more ? parameter_text(parameter) : value_text(parameter);
    if (stays) {
      const std::string written = "value = " + value_text(parameter);
      text.replace(text.find(written), written.size(), "value = " + std::string(document_.text(node.span)));
    }
    edits_.replace(node.span, std::move(text));
  }

  static std::vector<std::string_view> parameter_order(const Effect& effect) {
    std::vector<std::string_view> names;
    for (const Parameter& parameter : effect.parameters) names.push_back(parameter.name);
    return names;
  }

  EditedDocument document_;
  Edits edits_;
};

}  // namespace

std::string rewrite(const ModelFile& file, const Model& changed) {
  if (file.text.empty()) return write(changed);
  const Model model = without_unknowns(changed);
  std::string text = file.text;
  // Every round but the last changes something for good, one key of each effect at the least.
  std::size_t rounds = 20 + model.effects.size() + file.model.effects.size();
  for (const Effect& effect : model.effects) rounds += 8 * effect.parameters.size() + (effect.definition ? 12 : 0);
  for (;;) {
    std::optional<std::string> next = Round(text).run(model);
    if (!next) break;
    text = std::move(*next);
    if (rounds-- == 0) throw std::logic_error("the written model does not come to rest");
  }
  require_reads_as(text, model);
  return text;
}

}  // namespace flexspline::model
