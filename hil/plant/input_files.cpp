#include "hil/plant/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// The reader asserts conditions that it then checks itself: a header such as "[.x]" would end the program where asserts
// are on, and the optimiser could remove the check where they are off. Without either it is an error with a line
// number. Every source that includes the reader needs these lines, as the linker takes one of several compiled copies
// of a function.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include "hil/plant/demo_drive.hpp"
#include "hil/plant/tables.hpp"

namespace flexspline::plant {
namespace {

/// Reads the keys of one table and refuses unknown ones: a misspelt key must not be replaced by a default.
class Section {
 public:
  Section(const toml::table& table, std::string_view origin, std::string where)
      : table_(table), origin_(origin), where_(std::move(where)) {}

  [[noreturn]] void fail(const toml::node* node, const std::string& what) const {
    const auto line = (node == nullptr ? table_.source() : node->source()).begin.line;
    throw std::runtime_error(fmt::format("{}:{}: {}: {}", origin_, line, where_, what));
  }

  double number(std::string_view key, double& value, bool required = false) {
    read(key, value, required, "a finite number");
    if (!std::isfinite(value)) fail(table_.get(key), fmt::format("{} must be a finite number", key));
    return value;
  }
  void positive(std::string_view key, double& value, bool required = false) {
    if (!(number(key, value, required) > 0.0)) fail(table_.get(key), fmt::format("{} must be positive", key));
  }
  void not_negative(std::string_view key, double& value) {
    if (number(key, value) < 0.0) fail(table_.get(key), fmt::format("{} must not be negative", key));
  }
  void flag(std::string_view key, bool& value) { read(key, value, false, "true or false"); }
  void whole(std::string_view key, int& value, int least) {
    read(key, value, false, "a whole number");
    if (value < least) fail(table_.get(key), fmt::format("{} must be at least {}", key, least));
  }
  void text(std::string_view key, std::string& value, bool required = false) { read(key, value, required, "text"); }
  /// The node of a key, of any type; nullptr where there is none.
  const toml::node* node(std::string_view key) {
    known_.emplace_back(key);
    return table_.get(key);
  }
  const toml::table* table(std::string_view key) {
    known_.emplace_back(key);
    const toml::node* node = table_.get(key);
    if (node != nullptr && !node->is_table()) fail(node, fmt::format("{} must be a table", key));
    return node == nullptr ? nullptr : node->as_table();
  }
  /// The value that the text under `key` names.
  template <class T>
  void choice(std::string_view key, T& value, std::initializer_list<std::pair<std::string_view, T>> names) {
    std::string name;
    text(key, name);
    if (name.empty()) return;
    std::string all;
    for (const auto& [label, meaning] : names) {
      if (label == name) {
        value = meaning;
        return;
      }
      all += fmt::format("{}{}", all.empty() ? "" : ", ", label);
    }
    fail(table_.get(key), fmt::format("{} = \"{}\" is unknown; use one of {}", key, name, all));
  }
  void done() const {
    for (const auto& [key, node] : table_) {
      if (std::find(known_.begin(), known_.end(), key.str()) == known_.end()) {
        fail(&node, fmt::format("unknown key \"{}\"; take it out or correct its spelling", key.str()));
      }
    }
  }

 private:
  template <class T>
  void read(std::string_view key, T& value, bool required, std::string_view kind) {
    known_.emplace_back(key);
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      if (required) fail(nullptr, fmt::format("the key \"{}\" is missing", key));
      return;
    }
    const auto found = node->value<T>();
    if (!found) fail(node, fmt::format("{} must be {}", key, kind));
    value = *found;
  }

  const toml::table& table_;
  std::string_view origin_;
  std::string where_;
  std::vector<std::string> known_;
};

template <class Reader>
void for_each_table(const toml::table& root, std::string_view key, std::string_view origin, Reader read) {
  const toml::node* node = root.get(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const toml::table* table = list->get(i)->as_table();
    if (table == nullptr)
      list = nullptr;
    else
      read(*table);
  }
  if (list == nullptr) {
    throw std::runtime_error(
        fmt::format("{}:{}: {} must be written as [[{}]]", origin, node->source().begin.line, key, key));
  }
}

std::string text_of(const std::filesystem::path& file, std::string_view kind) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(fmt::format("{}: cannot be read; check the path of the {}", file.string(), kind));
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

toml::table parse_ascii(std::string_view text, std::string_view origin) {
  // Outside quotes and comments the reader's behaviour is undefined for some characters beyond ASCII. These files do
  // not need them.
  const auto foreign =
      std::find_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > 127; });
  if (foreign != text.end()) {
    throw std::runtime_error(
        fmt::format("{}:{}: a letter or sign that is not ASCII; write it in plain ASCII, comments too", origin,
                    1 + std::count(text.begin(), foreign, '\n')));
  }
  try {
    return toml::parse(text, origin);
  } catch (const toml::parse_error& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", origin, error.source().begin.line, error.description()));
  }
}

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

// Half a day at a thousand samples a second: a longer time is probably in another unit.
constexpr double kMostSamples = 5e7;

void read_duration(Section& section, const toml::table& table, const Drive& drive, ExperimentPlan& plan) {
  section.positive("duration_s", plan.duration_s);
  if (plan.duration_s > kMostSamples * drive.sample_s)
    section.fail(
        table.get("duration_s"),
        fmt::format("duration_s is {:g}, with a sample each {:g} s more than {:g} samples; make it shorter, or "
                    "several runs of it",
                    plan.duration_s, drive.sample_s, kMostSamples));
}

ExperimentPlan read_experiment(const toml::table& table, std::string_view origin, const Drive& drive) {
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
  read_duration(section, table, drive, plan);
  section.flag("locked", plan.locked);
  section.choice("role", plan.holdout, {{"fit", false}, {"holdout", true}});
  section.number("temperature_c", plan.temperature_c);
  section.number("temperature_rise_c", plan.temperature_rise_c);
  section.number("start_output_rad", plan.start_output_rad);
  section.done();
  return plan;
}

std::vector<Line> read_lines(const Section& section, const toml::node& node) {
  std::vector<Line> lines;
  const toml::array* list = node.as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const toml::array* line = list->get(i)->as_array();
    if (line == nullptr || line->size() != 3)
      section.fail(list->get(i), "a line is [harmonic, phase in turns, weight]");
    const auto harmonic = line->get(0)->value<int>();
    const auto phase = line->get(1)->value<double>(), weight = line->get(2)->value<double>();
    if (!harmonic || !phase || !weight || *harmonic < 1)
      section.fail(line, "a line is [harmonic, phase in turns, weight]");
    lines.push_back({*harmonic, *phase, *weight});
  }
  return lines;
}

ExperimentPlan read_run(const toml::table& table, std::string_view origin, const Drive& drive) {
  ExperimentPlan plan;
  plan.fades_out = true;
  plan.temperature_c = drive.temperature_reference_c;
  Section section(table, origin, "[[run]]");
  section.text("name", plan.name, true);
  if (plan.name.empty() || plan.name.find_first_of("/\\\"\n") != std::string::npos)
    section.fail(table.get("name"), "a name becomes a file name: it must not be empty or hold slashes or quotes");
  section.choice("mode", plan.mode, {{"off", Mode::off}, {"current", Mode::current}, {"velocity", Mode::velocity}});
  section.choice("waveform", plan.waveform,
                 {{"zero", Waveform::zero},
                  {"sine", Waveform::sine},
                  {"inverted_sine", Waveform::inverted_sine},
                  {"composite", Waveform::composite},
                  {"multi_sine", Waveform::multi_sine},
                  {"asymmetric_sine", Waveform::asymmetric_sine},
                  {"square", Waveform::square},
                  {"saw_tooth", Waveform::saw_tooth},
                  {"triangle", Waveform::triangle}});
  section.not_negative("amplitude", plan.amplitude);
  section.number("offset", plan.offset);
  section.not_negative("frequency_hz", plan.frequency_hz);
  section.number("end_frequency_hz", plan.end_frequency_hz);
  section.not_negative("slope_limit", plan.slope_limit);
  read_duration(section, table, drive, plan);
  section.choice("load", plan.locked, {{"free", false}, {"locked", true}});
  section.number("load_torque_nm", plan.load_torque_nm);
  section.number("temperature_c", plan.temperature_c);
  std::string instructions;
  section.text("instructions", instructions);
  if (const toml::node* lines = section.node("lines")) plan.lines = read_lines(section, *lines);
  section.done();
  if (plan.waveform == Waveform::multi_sine && plan.lines.empty())
    section.fail(nullptr, "a multi_sine needs lines = [[harmonic, phase in turns, weight], ...]");
  return plan;
}

}  // namespace

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
  if (const toml::table* table = top.table("amplifier")) {
    Section amplifier(*table, origin, "[amplifier]");
    amplifier.not_negative("saturation_a", drive.amplifier.saturation_a);
    amplifier.not_negative("bandwidth_hz", drive.amplifier.bandwidth_hz);
    amplifier.number("offset_a", drive.amplifier.offset_a);
    amplifier.done();
  }
  if (const toml::table* table = top.table("thermal")) {
    Section thermal(*table, origin, "[thermal]");
    thermal.positive("capacity_j_c", drive.thermal.capacity_j_c, true);
    thermal.positive("resistance_c_w", drive.thermal.resistance_c_w, true);
    thermal.not_negative("winding_ohm", drive.thermal.winding_ohm);
    double ambient_c = drive.temperature_reference_c;
    drive.thermal.ambient_c = thermal.number("ambient_c", ambient_c);
    thermal.done();
  }
  for (const auto& [key, node] : root) {
    static constexpr std::string_view kKnown[] = {"format",    "name",    "drive",  "sensors",   "velocity_loop",
                                                  "amplifier", "thermal", "effect", "experiment"};
    if (std::find(std::begin(kKnown), std::end(kKnown), key.str()) == std::end(kKnown)) {
      top.fail(&node, fmt::format("unknown key \"{}\"; take it out or correct its spelling", key.str()));
    }
  }
  for_each_table(root, "effect", origin,
                 [&](const toml::table& t) { drive.effects.push_back(read_effect(t, origin)); });
  for_each_table(root, "experiment", origin,
                 [&](const toml::table& t) { plant.experiments.push_back(read_experiment(t, origin, drive)); });
  return plant;
}

PlantFile load_plant(const std::filesystem::path& file) {
  return parse_plant(text_of(file, "plant file"), file.string());
}

PlantFile demo_plant() {
  return parse_plant(kDemoDrive, "demo-drive.toml");
}

std::vector<ExperimentPlan> load_plan(const std::filesystem::path& file, Drive& drive) {
  const std::string origin = file.string();
  const toml::table root = parse_ascii(text_of(file, "plan"), origin);
  Section top(root, origin, "plan");
  std::string text;
  top.text("format", text, true);
  if (text != "flexspline-plan/1") top.fail(root.get("format"), "format must be \"flexspline-plan/1\"");
  top.text("model", text);
  top.positive("sample_s", drive.sample_s);
  top.node("separate");
  top.node("run");
  if (const toml::table* limits = top.table("limits")) {
    Section section(*limits, origin, "[limits]");
    double current_a = 0.0, other = 0.0;
    section.not_negative("current_a", current_a);
    if (current_a > 0.0) drive.current_limit_a = std::min(drive.current_limit_a, current_a);
    for (const char* key : {"velocity_rad_s", "travel_rad", "duration_s", "load_torque_nm"})
      section.not_negative(key, other);
    section.done();
  }
  top.done();
  std::vector<ExperimentPlan> runs;
  for_each_table(root, "run", origin, [&](const toml::table& t) { runs.push_back(read_run(t, origin, drive)); });
  return runs;
}

namespace {

std::vector<double> numbers_in(const toml::array& list) {
  std::vector<double> all;
  for (const toml::node& node : list) {
    const auto x = node.value<double>();
    if (!x || !std::isfinite(*x)) return {};
    all.push_back(*x);
  }
  return all;
}

Entries entries_of(const toml::table& table) {
  Entries out;
  out.line = static_cast<std::size_t>(table.source().begin.line);
  for (const auto& [key, node] : table) {
    Entry entry;
    entry.name = key.str();
    entry.line = static_cast<std::size_t>(node.source().begin.line);
    if (const toml::table* inner = node.as_table()) {
      entry.tables.push_back(entries_of(*inner));
    } else if (const toml::array* list = node.as_array()) {
      entry.is_list = true;
      entry.numbers = numbers_in(*list);
      for (const toml::node& element : *list) {
        if (const toml::table* one = element.as_table()) entry.tables.push_back(entries_of(*one));
        if (const toml::array* row = element.as_array()) entry.rows.push_back(numbers_in(*row));
        if (const auto text = element.value<std::string>()) entry.texts.push_back(*text);
      }
    } else {
      if (const auto x = node.value<double>(); x && std::isfinite(*x) && !node.is_boolean()) entry.numbers = {*x};
      if (const auto text = node.value<std::string>(); text && node.is_string()) entry.texts = {*text};
    }
    out.entries.push_back(std::move(entry));
  }
  return out;
}

}  // namespace

Entries read_entries(std::string_view text, std::string_view origin) {
  return entries_of(parse_ascii(text, origin));
}

std::string read_text(const std::filesystem::path& file, std::string_view kind) {
  return text_of(file, kind);
}

}  // namespace flexspline::plant
