// A small catalogue for tests of model files, apart from the real one.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/physics/model/model.hpp"

namespace flexspline::model {

class SomeEffects : public KnownEffects {
 public:
  SomeEffects() {
    add("viscous_friction", {{"coefficient", "N*m*s/rad", "N*s/m", 0.0, 10.0, false}});
    add("coulomb_friction", {{"torque", "N*m", "N", 0.0, 100.0, false}});
    add("power_law_friction",
        {{"torque", "N*m", "N", 0.0, 100.0, false}, {"exponent", "-", "-", 0.05, 0.7853981633974483, false}});
    add("torque_ripple", {{"order", "-", "-", 0.001, 1000.0, true},
                          {"cosine", "N*m", "N", -10.0, 10.0, false},
                          {"sine", "N*m", "N", -10.0, 10.0, false}});
  }
  const KnownEffect* find(std::string_view name) const override {
    const auto found = effects_.find(name);
    return found == effects_.end() ? nullptr : &found->second;
  }
  std::vector<std::string_view> names() const override {
    std::vector<std::string_view> result;
    for (const auto& [name, effect] : effects_) result.push_back(name);
    return result;
  }

 private:
  void add(std::string_view name, std::vector<KnownParameter> parameters) {
    effects_.emplace(name, KnownEffect{name, std::move(parameters)});
  }
  std::map<std::string_view, KnownEffect> effects_;
};

// An effect of that catalogue on a rotary axis, without values.
inline Effect effect_of(const std::string& type, const std::string& id = {}) {
  Effect effect{type, id.empty() ? type : id, {}};
  const SomeEffects effects;
  const KnownEffect* known = effects.find(type);
  if (known == nullptr) throw std::invalid_argument("no effect " + type);
  for (const KnownParameter& parameter : known->parameters)
    effect.parameters.push_back({std::string(parameter.name), {}, parameter.unit_rotary, {}, {}, false});
  return effect;
}

}  // namespace flexspline::model
