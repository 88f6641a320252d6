#include "host/physics/catalogue/constants.hpp"

#include <numbers>

#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::catalogue {
namespace {

class CatalogueEffects final : public model::KnownEffects {
 public:
  CatalogueEffects() {
    for (const Entry& entry : all()) {
      model::KnownEffect known{entry.name(), {}, model::Form::plain};
      for (const auto& p : entry.parameters) {
        // Bounds of a ratio or a root say only the sign of the parameter itself.
        const bool own = p.per.empty() && p.root_of.empty();
        const double low = own ? p.low : p.low >= 0.0 ? 0.0 : -effects::kUnbounded;
        const double high = own ? p.high : effects::kUnbounded;
        known.parameters.push_back(
            {p.name, std::string(p.unit.rotary), std::string(p.unit.linear), low, high, p.kind == Kind::given});
      }
      effects_.push_back(std::move(known));
    }
    effects_.push_back({kTableEffect, {}, model::Form::table});
    effects_.push_back({kExpressionEffect, {}, model::Form::formula});
  }
  const model::KnownEffect* find(std::string_view name) const override {
    for (const auto& known : effects_)
      if (known.name == name) return &known;
    return nullptr;
  }
  std::vector<std::string_view> names() const override {
    std::vector<std::string_view> names;
    for (const auto& known : effects_) names.push_back(known.name);
    return names;
  }
  std::optional<model::Objection> objection(const model::Effect& effect) const override { return objection_to(effect); }

 private:
  std::vector<model::KnownEffect> effects_;
};

}  // namespace

DriveConstants<double> constants_of(const model::Drive& drive) {
  DriveConstants<double> constants;
  constants.gear_ratio = drive.gear_ratio.value.value_or(1.0);
  constants.torque_constant = drive.torque_constant_nm_a.value.value_or(1.0);
  constants.rated_velocity = drive.rated_velocity_rad_s.value.value_or(1.0);
  constants.reference_temperature = drive.temperature_reference_c.value.value_or(30.0);
  if (drive.axis == data::Axis::linear && drive.pitch_m.value)
    constants.turn_angle_scale = 2.0 * std::numbers::pi / *drive.pitch_m.value;
  return constants;
}

std::string_view unit_on(const effects::Unit& unit, data::Axis axis) {
  return axis == data::Axis::linear ? unit.linear : unit.rotary;
}

const model::KnownEffects& known_effects() {
  static const CatalogueEffects known;
  return known;
}

std::vector<double> values_of(const model::Effect& effect, const Entry& entry) {
  std::vector<double> values;
  for (const auto& info : entry.parameters) {
    const model::Parameter* parameter = effect.find(info.name);
    values.push_back(parameter ? parameter->value.value_or(0.0) : 0.0);
  }
  return values;
}

model::Effect blank_effect(const Entry& entry, data::Axis axis) {
  model::Effect effect;
  effect.type = effect.id = std::string(entry.name());
  for (const auto& info : entry.parameters) {
    model::Parameter parameter;
    parameter.name = std::string(info.name);
    parameter.unit = std::string(unit_on(info.unit, axis));
    parameter.fixed = info.kind == Kind::given;
    effect.parameters.push_back(std::move(parameter));
  }
  return effect;
}

}  // namespace flexspline::catalogue
