#include "host/engine/sensitivity/changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::sensitivity {
namespace {

// True while the model has the effect, or one that takes its place.
bool is_placeholder(const model::Model& model, std::string_view type) {
  return std::any_of(model.effects.begin(), model.effects.end(), [&](const model::Effect& e) {
    return e.type == type || catalogue::names_contain(catalogue::entry_of(e).info->replaces, type);
  });
}

template <class List, class Name>
std::string names_of(const List& list, Name name) {
  std::string names;
  for (const auto& item : list) names += (names.empty() ? "" : ", ") + name(item);
  return names;
}

void require_within_bounds(const model::Effect& effect, std::size_t p, const Change& change) {
  const catalogue::Entry& entry = catalogue::entry_of(effect);
  const effects::ParameterInfo& info = entry.parameters[p];
  // Bounds hold for parameters as they are searched for.
  const double value = catalogue::reduced(entry, catalogue::values_of(effect, entry))[p];
  if (value >= info.low && value <= info.high) return;
  throw model::ModelError(
      fmt::format("{}: the value would be {:g}, and {} must be from {:g} to {:g}; choose another factor",
                  change.label(), *effect.parameters[p].value, info.name, info.low, info.high));
}

}  // namespace

std::string Change::label() const {
  return leaves_out() ? "without " + effect : fmt::format("{}.{} x {:g}", effect, parameter, factor);
}

Change parse_scaling(std::string_view text) {
  const std::size_t equals = text.rfind('=');
  const std::size_t dot = text.substr(0, equals).rfind('.');
  constexpr const char* kWrite = "write EFFECT.PARAMETER=FACTOR, as in linear_stiffness.stiffness=10";
  if (equals == std::string_view::npos || dot == std::string_view::npos || dot == 0 || dot + 1 >= equals)
    throw std::invalid_argument(fmt::format("{}: this is no scaling of a parameter; {}", text, kWrite));
  const std::string_view number = text.substr(equals + 1);
  Change change{std::string(text.substr(0, dot)), std::string(text.substr(dot + 1, equals - dot - 1)), 0.0};
  const auto parsed = std::from_chars(number.data(), number.data() + number.size(), change.factor);
  if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size() || !std::isfinite(change.factor))
    throw std::invalid_argument(fmt::format("{}: \"{}\" is no factor; {}", text, number, kWrite));
  return change;
}

std::vector<Change> usual_changes(const model::Model& model) {
  std::vector<Change> changes;
  for (const model::Effect& e : model.effects) changes.push_back({e.id, "", 0.0});
  for (const model::Effect& e : model.effects)
    if (e.type == "linear_stiffness")
      for (const double factor : {0.1, 10.0}) changes.push_back({e.id, "stiffness", factor});
  return changes;
}

void require_known(const model::Model& model, const Change& change) {
  const model::Effect* effect = model.find(change.effect);
  if (!effect)
    throw model::ModelError(fmt::format("{}: the model has no effect \"{}\"; it has {}", change.label(), change.effect,
                                        names_of(model.effects, [](const model::Effect& e) { return e.id; })));
  if (!change.leaves_out() && !effect->find(change.parameter))
    throw model::ModelError(
        fmt::format("{}: {} has no parameter \"{}\"; it has {}", change.label(), change.effect, change.parameter,
                    names_of(effect->parameters, [](const model::Parameter& p) { return p.name; })));
}

ChangedModel apply(const model::Model& model, const Change& change) {
  require_known(model, change);
  ChangedModel changed{model, {}};
  if (!change.leaves_out()) {
    model::Effect& effect = *changed.model.find(change.effect);
    model::Parameter& parameter = *effect.find(change.parameter);
    if (!parameter.value)
      throw model::ModelError(fmt::format(
          "{}: the parameter has no value to scale; identify first, or write it into the model file", change.label()));
    *parameter.value *= change.factor;
    parameter.fixed = true;
    require_within_bounds(effect, static_cast<std::size_t>(&parameter - effect.parameters.data()), change);
    return changed;
  }
  std::vector<model::Effect>& effects = changed.model.effects;
  std::erase_if(effects, [&](const model::Effect& e) { return e.id == change.effect; });
  const auto scales_nothing = [&](const model::Effect& e) {
    const std::string_view scaled = catalogue::entry_of(e).info->modulates;
    return !scaled.empty() && !is_placeholder(changed.model, scaled);
  };
  for (const model::Effect& e : effects)
    if (scales_nothing(e)) changed.also_left_out.push_back(e.id);
  std::erase_if(effects, [&](const model::Effect& e) {
    return std::find(changed.also_left_out.begin(), changed.also_left_out.end(), e.id) != changed.also_left_out.end();
  });
  return changed;
}

}  // namespace flexspline::sensitivity
