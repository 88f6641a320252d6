#include "hil/scenario/scenario_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <stdexcept>

#include "hil/plant/tables.hpp"
#include "hil/scenario/built_in.hpp"

namespace flexspline::scenario {
namespace {

using board::Event;
using board::Motion;
using plant::Entries;
using plant::Entry;

constexpr double kMostS = 36000.0;

// The keys of one table; unknown ones are an error.
class Table {
 public:
  Table(const Entries& entries, std::string origin, std::string where)
      : entries_(entries), origin_(std::move(origin)), where_(std::move(where)) {}

  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw std::runtime_error(fmt::format("{}:{}: {}: {}", origin_, line == 0 ? 1 : line, where_, what));
  }
  const Entry* find(const std::string& key) {
    taken_.insert(key);
    for (const Entry& entry : entries_.entries)
      if (entry.name == key) return &entry;
    return nullptr;
  }
  std::string text(const std::string& key, const std::string& otherwise = {}) {
    const Entry* e = find(key);
    if (e == nullptr) return otherwise;
    if (e->is_list || e->texts.size() != 1) fail(e->line, key + " must be a text");
    return e->texts.front();
  }
  std::string needed(const std::string& key) {
    if (find(key) == nullptr) fail(entries_.line, fmt::format("the key \"{}\" is missing", key));
    return text(key);
  }
  double number(const std::string& key, double otherwise, double least, double most) {
    const Entry* e = find(key);
    if (e == nullptr) return otherwise;
    if (e->is_list || e->numbers.size() != 1) fail(e->line, key + " must be a finite number");
    if (!(e->numbers.front() >= least && e->numbers.front() <= most))
      fail(e->line,
           fmt::format("{} is {:g}; it has to be between {:g} and {:g}", key, e->numbers.front(), least, most));
    return e->numbers.front();
  }
  double needed_number(const std::string& key, double least, double most) {
    if (find(key) == nullptr) fail(entries_.line, fmt::format("the key \"{}\" is missing", key));
    return number(key, 0.0, least, most);
  }
  // An optional number.
  std::vector<double> maybe(const std::string& key, double least, double most) {
    if (find(key) == nullptr) return {};
    return {number(key, 0.0, least, most)};
  }
  std::vector<std::string> texts(const std::string& key) {
    const Entry* e = find(key);
    if (e == nullptr) return {};
    if (!e->is_list || (e->texts.empty() && !(e->numbers.empty() && e->rows.empty() && e->tables.empty())))
      fail(e->line, key + " must be a list of texts");
    return e->texts;
  }
  std::vector<std::vector<double>> rows(const std::string& key, std::size_t columns, const char* what) {
    const Entry* e = find(key);
    if (e == nullptr) fail(entries_.line, fmt::format("the key \"{}\" is missing", key));
    const bool good = e->is_list && !e->rows.empty() &&
                      std::all_of(e->rows.begin(), e->rows.end(), [&](const auto& r) { return r.size() == columns; });
    if (!good) fail(e->line, fmt::format("{} must be a list of {}", key, what));
    return e->rows;
  }
  const Entries* table(const std::string& key) {
    const Entry* e = find(key);
    if (e == nullptr) return nullptr;
    if (e->is_list || e->tables.size() != 1) fail(e->line, fmt::format("{} must be a table", key));
    return &e->tables.front();
  }
  std::size_t line_of(const std::string& key) {
    const Entry* e = find(key);
    return e == nullptr ? entries_.line : e->line;
  }
  void done() const {
    for (const Entry& entry : entries_.entries)
      if (!taken_.contains(entry.name))
        fail(entry.line, fmt::format("unknown key \"{}\"; there are {}", entry.name,
                                     fmt::join(taken_.begin(), taken_.end(), ", ")));
  }

 private:
  const Entries& entries_;
  std::string origin_;
  std::string where_;
  std::set<std::string> taken_;
};

Motion motion_of(Table& table) {
  Motion m;
  const std::string kind = table.needed("kind");
  if (kind == "sines") {
    for (const auto& row : table.rows("sines", 3, "[amplitude in rad, frequency in Hz, ahead in s]")) {
      if (row[1] < 0.0 || row[1] > 100.0) table.fail(table.line_of("sines"), "a frequency is between 0 and 100 Hz");
      m.sines.push_back({row[0], row[1], row[2]});
    }
  } else if (kind == "constant") {
    m.kind = Motion::Kind::constant;
    m.velocity_rad_s = table.needed_number("velocity_rad_s", -100.0, 100.0);
  } else if (kind == "trapezoid") {
    m.kind = Motion::Kind::trapezoid;
    m.acceleration_rad_s2 = table.needed_number("acceleration_rad_s2", -1e4, 1e4);
    m.period_s = table.needed_number("period_s", 1e-2, kMostS);
  } else if (kind == "waypoints") {
    m.kind = Motion::Kind::waypoints;
    double before = 0.0;
    for (const auto& row : table.rows("waypoints", 2, "[time in s, position in rad]")) {
      if (row[0] < before + 1e-2)
        table.fail(table.line_of("waypoints"), "times of waypoints rise by at least 0.01 s, from zero on");
      m.waypoints.push_back({before = row[0], row[1]});
    }
  } else {
    table.fail(table.line_of("kind"),
               fmt::format("kind = \"{}\" is unknown; use one of sines, constant, trapezoid, waypoints", kind));
  }
  table.done();
  return m;
}

Event event_of(Table& table) {
  const std::string name = table.needed("what");
  const std::optional<Event> known = board::event_named(name);
  if (!known)
    table.fail(table.line_of("what"),
               fmt::format("no event \"{}\"; there are {}", name, fmt::join(board::event_names(), ", ")));
  Event event = *known;
  event.at_s = table.needed_number("at_s", 0.0, kMostS);
  event.duration_s = table.number("duration_s", 0.0, 0.0, kMostS);
  if (!board::event_unit(event.kind).empty()) {
    event.value = table.needed_number("value", -1e6, 1e6);
    const std::string unit = table.text("unit", std::string(board::event_unit(event.kind)));
    if (unit != board::event_unit(event.kind))
      table.fail(table.line_of("unit"),
                 fmt::format("the unit of {} is {}, not {}", name, board::event_unit(event.kind), unit));
    if (event.kind == Event::Kind::amplifier_saturation && event.value <= 0.0)
      table.fail(table.line_of("value"), "an amplifier saturates above zero");
  }
  table.done();
  return event;
}

const BuiltIn* built_in(std::string_view name) {
  for (const BuiltIn& one : kBuiltIn)
    if (name == one.name) return &one;
  return nullptr;
}

}  // namespace

ScenarioFile parse_scenario(std::string_view text, std::string_view origin) {
  const Entries root = plant::read_entries(text, origin);
  const std::string from(origin);
  Table top(root, from, "scenario");
  if (top.needed("format") != "flexspline-scenario/1")
    top.fail(top.line_of("format"), "format must be \"flexspline-scenario/1\"");
  ScenarioFile file;
  file.name = top.needed("name");
  const std::string what = top.text("what");
  file.duration_s = top.number("duration_s", file.duration_s, 1.1, kMostS);
  file.hold_s = top.number("hold_s", file.hold_s, 0.0, kMostS);
  file.load_torque_nm = top.number("load_torque_nm", 0.0, -1e6, 1e6);
  file.start_temperature_c = top.maybe("start_temperature_c", -100.0, 200.0);
  if (const Entry* named = top.find("motion"); named != nullptr && !named->texts.empty()) {
    try {
      file.motion = board::scenario(top.text("motion"));
    } catch (const std::invalid_argument& error) {
      top.fail(named->line, error.what());
    }
  } else if (const Entries* table = top.table("motion")) {
    Table motion(*table, from, "[motion]");
    file.motion.motion = motion_of(motion);
  } else {
    top.fail(root.line, "a scenario needs motion = \"NAME\" or a table [motion]");
  }
  file.motion.name = file.name;
  if (!what.empty()) file.motion.what = what;
  if (const Entries* table = top.table("plant")) {
    Table plant(*table, from, "[plant]");
    file.plant_file = plant.text("file");
    file.with = plant.texts("with");
    file.hide = plant.text("hide");
    file.hidden_scale = plant.number("hidden_scale", 1.0, 1e-3, 1e3);
    plant.done();
  }
  if (const Entries* table = top.table("amplifier")) {
    Table amplifier(*table, from, "[amplifier]");
    file.amplifier_bandwidth_hz = amplifier.maybe("bandwidth_hz", 1.0, 1e6);
    file.amplifier_saturation_a = amplifier.maybe("saturation_a", 1e-3, 1e6);
    file.amplifier_offset_a = amplifier.maybe("offset_a", -1e6, 1e6);
    amplifier.done();
  }
  if (const Entry* list = top.find("event")) {
    if (!list->is_list || list->tables.empty()) top.fail(list->line, "event must be written as [[event]]");
    for (const Entries& one : list->tables) {
      Table event(one, from, "[[event]]");
      file.events.push_back(event_of(event));
    }
  }
  top.done();
  return file;
}

ScenarioFile find_scenario(const std::string& name) {
  if (const BuiltIn* found = built_in(name)) return parse_scenario(found->text, name + ".toml");
  for (const board::Scenario& s : board::scenarios())
    if (s.name == name) {
      ScenarioFile file;
      file.name = s.name;
      file.motion = s;
      return file;
    }
  const std::filesystem::path path = name;
  if (std::filesystem::is_regular_file(path)) {
    ScenarioFile file = parse_scenario(plant::read_text(path, "scenario"), path.string());
    if (!file.plant_file.empty()) file.plant_file = (path.parent_path() / file.plant_file).string();
    return file;
  }
  std::string all;
  for (const Known& one : known_scenarios()) all += (all.empty() ? "" : ", ") + one.name;
  throw std::runtime_error(
      fmt::format("no scenario \"{}\": there is no such file, and the built-in ones are {}", name, all));
}

std::vector<Known> known_scenarios() {
  std::vector<Known> all;
  for (const board::Scenario& s : board::scenarios()) all.push_back({s.name, s.what});
  for (const BuiltIn& one : kBuiltIn) all.push_back({one.name, parse_scenario(one.text, one.name).motion.what});
  return all;
}

plant::Drive drive_of(const ScenarioFile& file, const std::string& plant_file, const std::vector<std::string>& more,
                      const std::string& hide) {
  const std::string& path = plant_file.empty() ? file.plant_file : plant_file;
  plant::Drive drive = path.empty() ? plant::demo_plant().drive : plant::load_plant(path).drive;
  for (const std::string& effect : file.with) plant::with(drive, effect);
  for (const std::string& effect : more) plant::with(drive, effect);
  const std::string& hidden = hide.empty() ? file.hide : hide;
  if (!hidden.empty() && hidden != "none") plant::hide(drive, hidden, hide.empty() ? file.hidden_scale : 1.0);
  for (const double x : file.amplifier_bandwidth_hz) drive.amplifier.bandwidth_hz = x;
  for (const double x : file.amplifier_saturation_a) drive.amplifier.saturation_a = x;
  for (const double x : file.amplifier_offset_a) drive.amplifier.offset_a = x;
  for (const double x : file.start_temperature_c) drive.thermal.start_c = x;
  return drive;
}

board::ScenarioPlan plan_of(const ScenarioFile& file, const plant::Drive& drive) {
  board::ScenarioPlan plan;
  plan.drive = drive;
  plan.scenario = file.name;
  plan.motion = file.motion;
  plan.duration_s = file.duration_s;
  plan.hold_s = file.hold_s;
  plan.events = file.events;
  plan.load_torque_nm = file.load_torque_nm;
  return plan;
}

}  // namespace flexspline::scenario
