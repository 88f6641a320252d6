#include "host/physics/model/same.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "host/physics/model/document.hpp"
#include "host/physics/model/text.hpp"
#include "host/physics/model/units.hpp"

namespace flexspline::model {
namespace {

[[noreturn]] void differ(const std::string& what) {
  throw std::logic_error("the written model does not read back: " + what);
}

// Whether `read` is what becomes of `meant` when written with `digits` or left as it was.
bool same(const std::optional<double>& read, const std::optional<double>& meant, int digits) {
  if (read.has_value() != meant.has_value()) return false;
  return !meant || *read == *meant || number_text(*read, digits) == number_text(*meant, digits);
}

bool same(const std::vector<double>& read, const std::vector<double>& meant, int digits) {
  return std::ranges::equal(read, meant, [digits](double a, double b) { return same(a, b, digits); });
}

bool same(const Definition& read, const Definition& meant) {
  return read.balance == meant.balance && read.variable == meant.variable && read.formula == meant.formula &&
         read.times_direction == meant.times_direction && read.table.fixed == meant.table.fixed &&
         same(read.table.at, meant.table.at, kPointDigits) && same(read.table.value, meant.table.value, kValueDigits) &&
         same(read.table.std, meant.table.std, kDeviationDigits);
}

void require_same_effect(const Effect& read, const Effect& meant) {
  if (read.type != meant.type) differ(fmt::format("the type of {}", meant.id));
  if (read.definition.has_value() != meant.definition.has_value() ||
      (meant.definition && !same(*read.definition, *meant.definition)))
    differ(fmt::format("what {} computes", meant.id));
  for (const Parameter& parameter : meant.parameters) {
    const Parameter* other = read.find(parameter.name);
    if (!other || !same(other->value, parameter.value, kValueDigits) ||
        !same(other->std, parameter.std, kDeviationDigits) ||
        !same(other->spread_percent, parameter.spread_percent, kDeviationDigits) || other->fixed != parameter.fixed ||
        other->low != parameter.low || other->high != parameter.high)
      differ(fmt::format("{} of {}", parameter.name, meant.id));
  }
  for (const Parameter& parameter : read.parameters)
    if (is_stated(parameter) && !meant.find(parameter.name)) differ(fmt::format("{} of {}", parameter.name, meant.id));
}

void drop_if_not_finite(std::optional<double>& number) {
  if (number && !std::isfinite(*number)) number.reset();
}

void require_finite(const std::optional<double>& number, const std::string& what) {
  if (number && !std::isfinite(*number))
    throw std::logic_error(fmt::format("{} is not finite, so the model cannot be written", what));
}

}  // namespace

EffectsOfModel::EffectsOfModel(const Model& model) {
  for (const Effect& effect : model.effects) {
    auto at = static_cast<std::size_t>(std::ranges::find(type_names_, effect.type) - type_names_.begin());
    if (at == type_names_.size()) {
      type_names_.push_back(effect.type);
      parameter_names_.emplace_back();
      effects_.emplace_back();
      if (effect.definition) effects_.back().form = effect.definition->variable.empty() ? Form::formula : Form::table;
    }
    for (const Parameter& parameter : effect.parameters) {
      if (std::ranges::find(parameter_names_[at], parameter.name) != parameter_names_[at].end()) continue;
      parameter_names_[at].push_back(parameter.name);
      effects_[at].parameters.push_back({{},
                                         parameter.unit,
                                         parameter.unit,
                                         -std::numeric_limits<double>::infinity(),
                                         std::numeric_limits<double>::infinity(),
                                         false});
    }
  }
  // Only now: the texts no longer move.
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    effects_[i].name = type_names_[i];
    for (std::size_t j = 0; j < effects_[i].parameters.size(); ++j)
      effects_[i].parameters[j].name = parameter_names_[i][j];
  }
}

const KnownEffect* EffectsOfModel::find(std::string_view name) const {
  const auto found = std::ranges::find(effects_, name, &KnownEffect::name);
  return found == effects_.end() ? nullptr : &*found;
}

std::vector<std::string_view> EffectsOfModel::names() const {
  return {type_names_.begin(), type_names_.end()};
}

Model without_unknowns(Model model) {
  for (const DriveKey& key : kDriveKeys) require_finite((model.drive.*key.quantity).value, std::string(key.key));
  std::set<std::string> ids;
  for (Effect& effect : model.effects) {
    if (effect.id.empty()) effect.id = effect.type;
    if (effect.type.empty()) throw std::logic_error("an effect without a type cannot be written");
    if (!ids.insert(effect.id).second)
      throw std::logic_error(fmt::format("two effects are named {}, so the model cannot be written", effect.id));
    for (Parameter& parameter : effect.parameters) {
      if (parameter.name.empty()) throw std::logic_error(fmt::format("a parameter of {} has no name", effect.id));
      require_finite(parameter.value, effect.id + "." + parameter.name);
      drop_if_not_finite(parameter.std);
      drop_if_not_finite(parameter.spread_percent);
    }
    if (!effect.definition) continue;
    Table& table = effect.definition->table;
    for (const std::vector<double>* list : {&table.at, &table.value})
      for (const double value : *list) require_finite(value, effect.id + ".table");
    if (!std::ranges::all_of(table.std, [](double x) { return std::isfinite(x); })) table.std.clear();
  }
  for (History& history : model.history) {
    drop_if_not_finite(history.rmse_before);
    drop_if_not_finite(history.rmse_after);
  }
  return model;
}

void require_reads_as(const std::string& text, const Model& model) {
  Model read;
  try {
    read = parse(text, "the written model", EffectsOfModel(model)).model;
  } catch (const ModelError& error) {
    differ(error.what());
  }
  if (read.name != model.name) differ("the name");
  if (read.drive.axis != model.drive.axis) differ("the axis");
  for (const DriveKey& key : kDriveKeys) {
    const Quantity& other = read.drive.*key.quantity;
    const Quantity& meant = model.drive.*key.quantity;
    if (other.value != meant.value || other.source != meant.source) differ(std::string(key.key));
  }
  if (read.effects.size() != model.effects.size()) differ("the number of effects");
  for (const Effect& meant : model.effects) {
    const Effect* other = read.find(meant.id);
    if (!other) differ(fmt::format("{} is not there", meant.id));
    require_same_effect(*other, meant);
  }
  if (read.history.size() != model.history.size()) differ("the number of history entries");
  for (std::size_t i = 0; i < model.history.size(); ++i) {
    const History& other = read.history[i];
    const History& meant = model.history[i];
    if (other.action != meant.action || other.effect != meant.effect ||
        !same(other.rmse_before, meant.rmse_before, kValueDigits) ||
        !same(other.rmse_after, meant.rmse_after, kValueDigits))
      differ(fmt::format("entry {} of the history", i + 1));
  }
}

}  // namespace flexspline::model
