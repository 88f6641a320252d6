#include "hil/plant/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include "hil/plant/demo_drive.hpp"
#include "hil/plant/toml_section.hpp"

namespace flexspline::plant {
namespace {

void read_sensor(Section& sensors, std::string_view name, std::string_view origin, Sensor& sensor, bool* present) {
  const toml::table* table = sensors.table(name);
  if (table == nullptr) return;
  Section section(*table, origin, fmt::format("[sensors.{}]", name));
  section.not_negative("noise_share", sensor.noise_share);
  section.not_negative("noise_floor", sensor.noise_floor);
  section.not_negative("correlation", sensor.correlation);
  if (sensor.correlation >= 1.0) section.fail(table->get("correlation"), "correlation must be below 1");
  section.not_negative("delay_samples", sensor.delay_samples);
  if (present != nullptr) section.flag("present", *present);
  section.done();
}

void read_encoder(Section& sensors, std::string_view name, std::string_view origin, int& counts, double& delay) {
  const toml::table* table = sensors.table(name);
  if (table == nullptr) return;
  Section section(*table, origin, fmt::format("[sensors.{}]", name));
  section.whole("counts", counts, 1);
  section.not_negative("delay_samples", delay);
  section.done();
}

void read_drive(const toml::table& table, std::string_view origin, Drive& drive) {
  Section section(table, origin, "[drive]");
  section.positive("gear_ratio", drive.gear_ratio, true);
  section.positive("torque_constant_nm_a", drive.torque_constant_nm_a, true);
  section.positive("rated_current_a", drive.rated_current_a, true);
  section.positive("rated_velocity_rad_s", drive.rated_velocity_rad_s, true);
  section.positive("rated_torque_nm", drive.rated_torque_nm, true);
  section.number("temperature_reference_c", drive.temperature_reference_c);
  section.positive("current_limit_a", drive.current_limit_a, true);
  section.positive("sample_s", drive.sample_s);
  section.whole("steps_per_sample", drive.steps_per_sample, 1);
  section.not_negative("friction_variation", drive.friction_variation);
  section.done();
}

Effect read_effect(const toml::table& table, std::string_view origin) {
  Effect effect;
  Section section(table, origin, "[[effect]]");
  section.text("type", effect.type, true);
  section.flag("present", effect.present);
  section.flag("catalogue", effect.catalogue);
  const toml::table* parameters = section.table("parameters");
  section.done();
  if (parameters == nullptr) section.fail(nullptr, "[effect.parameters] is missing");
  for (const auto& [key, node] : *parameters) {
    const toml::table* entry = node.as_table();
    if (entry == nullptr) section.fail(&node, fmt::format("{} must be {{ value = ..., unit = ... }}", key.str()));
    Parameter parameter;
    parameter.key = key.str();
    Section inner(*entry, origin, fmt::format("{}.{}", effect.type, parameter.key));
    inner.number("value", parameter.value, true);
    inner.text("unit", parameter.unit, true);
    inner.flag("scaled", parameter.scaled);
    inner.done();
    effect.parameters.push_back(parameter);
  }
  return effect;
}

ExperimentPlan read_experiment(const toml::table& table, std::string_view origin) {
  ExperimentPlan plan;
  Section section(table, origin, "[[experiment]]");
  section.text("name", plan.name, true);
  if (plan.name.empty() || plan.name.find_first_of("/\\\"\n") != std::string::npos) {
    section.fail(table.get("name"), "a name becomes a file name: it must not be empty or hold slashes or quotes");
  }
  section.choice("mode", plan.mode, {{"off", Mode::off}, {"current", Mode::current}, {"velocity", Mode::velocity}});
  section.choice("waveform", plan.waveform,
                 {{"zero", Waveform::zero},
                  {"sine", Waveform::sine},
                  {"asymmetric_sine", Waveform::asymmetric_sine},
                  {"triangle", Waveform::triangle},
                  {"trapezoid", Waveform::trapezoid},
                  {"square", Waveform::square},
                  {"composite", Waveform::composite}});
  section.number("amplitude", plan.amplitude);
  section.not_negative("frequency_hz", plan.frequency_hz);
  section.positive("duration_s", plan.duration_s);
  section.flag("locked", plan.locked);
  section.choice("role", plan.holdout, {{"fit", false}, {"holdout", true}});
  section.number("temperature_c", plan.temperature_c);
  section.number("temperature_rise_c", plan.temperature_rise_c);
  section.number("start_output_rad", plan.start_output_rad);
  section.done();
  return plan;
}

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
    // A ripple of another order: the same size as the one that the file has.
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

PlantFile parse_plant(std::string_view text, std::string_view origin) {
  const toml::table root = parse_ascii(text, origin);
  PlantFile plant;
  Drive& drive = plant.drive;
  Section top(root, origin, "plant");
  std::string format;
  top.text("format", format, true);
  if (format != "flexspline-plant/1") top.fail(root.get("format"), "format must be \"flexspline-plant/1\"");
  top.text("name", drive.name, true);
  const toml::table* drive_table = top.table("drive");
  if (drive_table == nullptr) top.fail(nullptr, "[drive] is missing");
  read_drive(*drive_table, origin, drive);
  if (const toml::table* table = top.table("sensors")) {
    Section sensors(*table, origin, "[sensors]");
    read_sensor(sensors, "current", origin, drive.sensors.current, nullptr);
    read_sensor(sensors, "torque", origin, drive.sensors.torque, nullptr);
    read_sensor(sensors, "temperature", origin, drive.sensors.temperature, nullptr);
    read_sensor(sensors, "tachometer", origin, drive.sensors.tachometer, &drive.sensors.has_tachometer);
    read_encoder(sensors, "motor_encoder", origin, drive.sensors.motor_counts, drive.sensors.motor_delay_samples);
    read_encoder(sensors, "output_encoder", origin, drive.sensors.output_counts, drive.sensors.output_delay_samples);
    sensors.done();
  }
  if (const toml::table* table = top.table("velocity_loop")) {
    Section loop(*table, origin, "[velocity_loop]");
    loop.not_negative("proportional_a_s_rad", drive.loop.proportional);
    loop.not_negative("integral_a_rad", drive.loop.integral);
    loop.done();
  }
  for (const auto& [key, node] : root) {
    static constexpr std::string_view kKnown[] = {"format",        "name",   "drive",     "sensors",
                                                  "velocity_loop", "effect", "experiment"};
    if (std::find(std::begin(kKnown), std::end(kKnown), key.str()) == std::end(kKnown)) {
      top.fail(&node, fmt::format("unknown key \"{}\"; take it out or correct its spelling", key.str()));
    }
  }
  for_each_table(root, "effect", origin,
                 [&](const toml::table& t) { drive.effects.push_back(read_effect(t, origin)); });
  for_each_table(root, "experiment", origin,
                 [&](const toml::table& t) { plant.experiments.push_back(read_experiment(t, origin)); });
  return plant;
}

PlantFile load_plant(const std::filesystem::path& file) {
  return parse_plant(text_of(file, "plant file"), file.string());
}

PlantFile demo_plant() {
  return parse_plant(kDemoDrive, "demo-drive.toml");
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
        fmt::format("no model can hold \"{}\": it can be hidden, but not be a known effect", effect));
  }
  found.present = true;
}

void without(Drive& drive, std::string_view effect) {
  select(drive, effect).present = false;
}

}  // namespace flexspline::plant
