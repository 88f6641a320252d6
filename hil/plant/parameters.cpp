#include "hil/plant/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flexspline::plant {
namespace {

/// Splits "torque_ripple:7" into type and order; an effect without an order matches any.
bool matches(const Effect& effect, std::string_view label) {
  const auto colon = label.find(':');
  if (colon == std::string_view::npos) return effect.type == label;
  return effect.label() == label;
}

Effect& select(Drive& drive, std::string_view label) {
  for (Effect& effect : drive.effects) {
    if (matches(effect, label)) return effect;
  }
  const auto colon = label.find(':');
  if (colon != std::string_view::npos) {
    // A ripple of another order has the size of the one in the file.
    const std::string_view type = label.substr(0, colon);
    const std::string digits(label.substr(colon + 1));
    const bool numeric =
        !digits.empty() && digits.size() < 5 && digits.find_first_not_of("0123456789") == std::string::npos;
    for (std::size_t i = 0; numeric && std::stoi(digits) > 0 && i < drive.effects.size(); ++i) {
      if (drive.effects[i].type != type || !drive.effects[i].has("order")) continue;
      Effect copy = drive.effects[i];
      copy.present = false;
      copy.hidden = false;
      copy.parameter("order").value = std::stoi(digits);
      drive.effects.push_back(copy);
      return drive.effects.back();
    }
  }
  std::string all;
  for (const Effect& effect : drive.effects) all += fmt::format("{}{}", all.empty() ? "" : ", ", effect.label());
  throw std::invalid_argument(fmt::format("the plant \"{}\" has no effect \"{}\"; it has {}", drive.name, label, all));
}

}  // namespace

bool Effect::has(std::string_view key) const {
  return std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& p) { return p.key == key; });
}

double Effect::value(std::string_view key) const {
  for (const Parameter& p : parameters) {
    if (p.key == key) return p.value;
  }
  throw std::invalid_argument(fmt::format("plant: effect \"{}\" lacks the parameter \"{}\"; add it", type, key));
}

Parameter& Effect::parameter(std::string_view key) {
  for (Parameter& p : parameters) {
    if (p.key == key) return p;
  }
  throw std::invalid_argument(fmt::format("plant: effect \"{}\" lacks the parameter \"{}\"; add it", type, key));
}

std::string Effect::label() const {
  return has("order") ? fmt::format("{}:{:g}", type, value("order")) : type;
}

const Effect* Drive::find(std::string_view type) const {
  for (const Effect& effect : effects) {
    if (effect.type == type && effect.present) return &effect;
  }
  return nullptr;
}

std::string Drive::hidden() const {
  for (const Effect& effect : effects) {
    if (effect.hidden) return effect.label();
  }
  return {};
}

void hide(Drive& drive, std::string_view effect, double scale) {
  if (!(std::isfinite(scale) && scale > 0.0)) {
    throw std::invalid_argument(fmt::format("an effect size must be a positive number, not {}", scale));
  }
  if (!drive.hidden().empty()) {
    throw std::invalid_argument(fmt::format("\"{}\" is hidden already; only one effect can be", drive.hidden()));
  }
  Effect& found = select(drive, effect);
  found.present = true;
  found.hidden = true;
  drive.hidden_scale = scale;
  for (Parameter& parameter : found.parameters) {
    if (parameter.scaled) parameter.value *= scale;
  }
}

void with(Drive& drive, std::string_view effect) {
  Effect& found = select(drive, effect);
  if (!found.catalogue) {
    throw std::invalid_argument(
        fmt::format("a model cannot have \"{}\": it can be hidden, but not be a known effect", effect));
  }
  found.present = true;
}

void without(Drive& drive, std::string_view effect) {
  select(drive, effect).present = false;
}

}  // namespace flexspline::plant
