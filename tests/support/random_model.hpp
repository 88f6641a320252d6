// Models at random, for what has to hold for all of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::tests {

// A drive somewhat like the report's with three to eight effects, none of which stands in for another, torques from a
// tenth to three times their usual size, nonlinear parameters from half to twice. With `only` it has that effect alone.
inline model::Model random_model(std::mt19937& random, const catalogue::Entry* only = nullptr) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto log_between = [&](double low, double high) { return std::exp(between(std::log(low), std::log(high))); };
  model::Model m;
  m.name = "random";
  m.drive.gear_ratio.value = between(50.0, 160.0);
  m.drive.torque_constant_nm_a.value = log_between(0.02, 0.2);
  m.drive.rated_current_a.value = log_between(1.0, 10.0);
  m.drive.rated_velocity_rad_s.value = between(100.0, 400.0);
  m.drive.rated_torque_nm.value = between(20.0, 80.0);
  m.drive.temperature_reference_c.value = between(15.0, 40.0);
  std::vector<const catalogue::Entry*> chosen;
  const auto all = catalogue::all();
  const std::size_t count = only != nullptr ? 1 : 3 + random() % 6;
  while (chosen.size() < count) {
    const catalogue::Entry& entry = only != nullptr ? *only : all[random() % all.size()];
    const bool clashes = std::any_of(chosen.begin(), chosen.end(), [&](const catalogue::Entry* other) {
      return other == &entry || catalogue::names_contain(entry.info->replaces, other->name()) ||
             catalogue::names_contain(other->info->replaces, entry.name());
    });
    if (entry.info->host_only || clashes) continue;
    chosen.push_back(&entry);
    std::vector<double> usual;
    for (const auto& p : entry.parameters) usual.push_back(p.usual);
    std::vector<double> values = catalogue::reduced(entry, usual);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto& p = entry.parameters[i];
      if (values[i] == 0.0)
        values[i] = i > 0 && p.unit.rotary == entry.parameters[i - 1].unit.rotary ? values[i - 1] : 0.1;
      const bool linear = p.kind == catalogue::Kind::linear;
      values[i] *= linear ? log_between(0.1, 3.0) : log_between(0.5, 2.0);
      if (linear && p.low < 0.0 && random() % 2 == 0) values[i] = -values[i];
      values[i] = std::clamp(values[i], p.low, p.high);
    }
    values = catalogue::natural(entry, values);
    model::Effect effect = catalogue::blank_effect(entry, m.drive.axis);
    for (std::size_t i = 0; i < values.size(); ++i) effect.parameters[i].value = values[i];
    m.effects.push_back(std::move(effect));
  }
  return m;
}

inline std::vector<deployment::EffectValues> values_of(const model::Model& m) {
  std::vector<deployment::EffectValues> effects;
  for (const auto& effect : m.effects) {
    const auto& entry = catalogue::get(effect.type);
    effects.push_back({entry.id, effect.id, catalogue::values_of(effect, entry)});
  }
  return effects;
}

}  // namespace flexspline::tests
