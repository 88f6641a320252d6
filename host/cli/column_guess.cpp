#include "host/cli/column_guess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

namespace flexspline::cli {
namespace {

using data::Quantity;

// "motorPos_rad/s" to motor, pos, rad, s.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  bool lower_before = false;
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) == 0) {
      if (!words.back().empty()) words.emplace_back();
      lower_before = false;
      continue;
    }
    if (std::isupper(u) != 0 && lower_before && !words.back().empty()) words.emplace_back();
    lower_before = std::islower(u) != 0;
    words.back() += static_cast<char>(std::tolower(u));
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

bool has_any(const std::vector<std::string>& words, std::initializer_list<std::string_view> wanted) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::find(wanted.begin(), wanted.end(), word) != wanted.end();
  });
}

// Units whose usual spelling has capitals, which names of columns seldom keep.
std::string unit_of_word(const std::string& word) {
  static constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
      {"a", "A"},        {"ma", "mA"},       {"amp", "A"},       {"amps", "A"},      {"n", "N"},
      {"kn", "kN"},      {"nm", "N*m"},      {"mnm", "mN*m"},    {"ncm", "N*cm"},    {"nmm", "N*mm"},
      {"knm", "kN*m"},   {"c", "degC"},      {"degc", "degC"},   {"k", "K"},         {"degf", "degF"},
      {"rads", "rad/s"}, {"radps", "rad/s"}, {"degs", "deg/s"},  {"degps", "deg/s"}, {"mps", "m/s"},
      {"seconds", "s"},  {"secs", "s"},      {"degrees", "deg"}, {"radians", "rad"}, {"millis", "ms"}};
  for (const auto& [spelling, unit] : kSpellings)
    if (spelling == word) return std::string(unit);
  return data::unit_from_text(word) ? word : std::string();
}

enum class Kind { none, time, current, torque, position, velocity, temperature };

Kind kind_of_quantity(Quantity quantity) {
  switch (quantity) {
    case Quantity::time:
      return Kind::time;
    case Quantity::current:
      return Kind::current;
    case Quantity::torque:
    case Quantity::force:
      return Kind::torque;
    case Quantity::angle:
    case Quantity::length:
    case Quantity::counts:
      return Kind::position;
    case Quantity::angular_velocity:
    case Quantity::velocity:
    case Quantity::counts_rate:
      return Kind::velocity;
    case Quantity::temperature:
      return Kind::temperature;
  }
  return Kind::none;
}

struct Reading {
  Kind kind = Kind::none;
  bool by_unit_only = false;
  bool set_point = false;
  bool output = false;
  bool motor = false;
  bool external = false;
  bool sensor = false;
  std::string unit;
};

Reading read(const std::string& name) {
  const std::vector<std::string> words = words_of(name);
  Reading r;
  r.unit = unit_in_name(name);
  const auto unit = data::unit_from_text(r.unit);
  if (has_any(words, {"error", "err", "index", "voltage", "volt", "volts", "pwm", "status", "flag", "mode", "counter",
                      "acceleration", "accel", "acc", "qdd", "jerk", "power", "id"}))
    return r;
  if (has_any(words, {"time", "t", "timestamp", "zeit"}))
    r.kind = Kind::time;
  else if (has_any(words, {"temperature", "temp"}))
    r.kind = Kind::temperature;
  else if (has_any(words, {"velocity", "vel", "speed", "omega", "w", "qd", "dq", "qdot", "rpm"}))
    r.kind = Kind::velocity;
  else if (has_any(words, {"torque", "force", "tau", "moment", "effort", "trq", "tq"}))
    r.kind = Kind::torque;
  else if (has_any(words, {"current", "iq", "i", "cur", "amps", "strom"}))
    r.kind = Kind::current;
  else if (has_any(words, {"position", "pos", "angle", "q", "theta", "phi", "enc", "encoder", "x"}))
    r.kind = Kind::position;
  else if (unit) {
    r.kind = kind_of_quantity(unit->quantity);
    r.by_unit_only = true;
  }
  if (unit && kind_of_quantity(unit->quantity) != r.kind) r.unit.clear();
  r.set_point = has_any(words, {"ref", "reference", "cmd", "command", "commanded", "set", "setpoint", "target",
                                "desired", "des", "sp", "demand", "soll"});
  r.output = has_any(words, {"output", "out", "joint", "link", "load", "arm", "flange"});
  r.motor = has_any(words, {"motor", "mot", "rotor", "wg"});
  r.external = has_any(words, {"external", "ext", "disturbance"});
  r.sensor = has_any(words, {"sensor", "transducer", "measured", "gear", "gearbox", "flexspline"});
  return r;
}

std::string ours_for(const Reading& r, bool other_effort) {
  switch (r.kind) {
    case Kind::none:
      return {};
    case Kind::time:
      return "time_s";
    case Kind::temperature:
      return "temperature_c";
    case Kind::current:
      return r.set_point ? "current_command_a" : "current_a";
    case Kind::position:
      return r.set_point ? "position_command_rad" : r.output ? "output_position_rad" : "motor_position_rad";
    case Kind::velocity:
      return r.set_point ? "velocity_command_rad_s" : r.output ? "output_velocity_rad_s" : "motor_velocity_rad_s";
    case Kind::torque:
      if (r.set_point) return {};
      if (r.external) return "load_torque_nm";
      if (r.output || r.sensor) return "torque_nm";
      return r.motor || !other_effort ? "motor_torque_nm" : "torque_nm";
  }
  return {};
}

std::string reason(const std::string& theirs, const Reading& r) {
  static constexpr std::string_view kNames[] = {"",           "a time",     "a current",    "a torque or force",
                                                "a position", "a velocity", "a temperature"};
  const std::string_view kind = kNames[static_cast<std::size_t>(r.kind)];
  std::string text = fmt::format("\"{}\" reads as {}{}{}", theirs, kind, r.set_point ? ", a set point" : "",
                                 r.output  ? ", of the output"
                                 : r.motor ? ", of the motor"
                                           : "");
  if (r.by_unit_only) text += ", by its unit alone";
  return r.unit.empty() ? text + "; no unit in its name, taken as SI" : text;
}

bool is_linear_unit(const std::string& text) {
  const auto unit = data::unit_from_text(text);
  return unit && (unit->quantity == Quantity::length || unit->quantity == Quantity::velocity ||
                  unit->quantity == Quantity::force);
}

class Guesser {
 public:
  Guesser(const std::vector<std::string>& names, const std::vector<ColumnGuess>& stated) : names_(names) {
    for (const ColumnGuess& column : stated) result_.columns.push_back(column);
  }

  HeaderGuess guess(std::optional<data::Axis> axis) {
    for (const std::string& name : names_)
      if (is_ours(name) && !is_mapped(name)) result_.native.push_back(name);
    bool current = is_mapped("current_a") || is_native("current_a");
    for (const std::string& name : names_) current = current || (is_free(name) && read(name).kind == Kind::current);
    // Names that say more come first; a unit alone is the weakest sign.
    for (const bool by_unit_only : {false, true})
      for (const std::string& name : names_)
        if (is_free(name)) take(name, by_unit_only, current);
    for (const std::string& name : names_)
      if (is_free(name) && !name.empty()) result_.unused.push_back(name);
    take_output_for_motor();
    find_axis(axis);
    return std::move(result_);
  }

 private:
  static bool is_ours(const std::string& name) { return name == "time_s" || data::column_from_name(name); }
  bool is_mapped(const std::string& ours) const {
    return std::any_of(result_.columns.begin(), result_.columns.end(),
                       [&](const ColumnGuess& c) { return c.ours == ours; });
  }
  bool is_native(const std::string& name) const {
    return std::find(result_.native.begin(), result_.native.end(), name) != result_.native.end();
  }
  bool is_source(const std::string& name) const {
    return std::any_of(result_.columns.begin(), result_.columns.end(),
                       [&](const ColumnGuess& c) { return c.theirs == name; });
  }
  bool is_free(const std::string& name) const { return !is_ours(name) && !is_source(name); }

  void take(const std::string& name, bool by_unit_only, bool current) {
    const Reading r = read(name);
    if (r.by_unit_only != by_unit_only) return;
    const bool effort = current || is_mapped("motor_torque_nm") || is_native("motor_torque_nm");
    const std::string ours = ours_for(r, effort);
    if (ours.empty() || is_mapped(ours) || is_native(ours)) return;
    result_.columns.push_back({ours, name, r.unit, reason(name, r)});
  }

  // Logs of a joint have no motor encoder: the joint's own columns are the motor's then, and the gear ratio is one.
  void take_output_for_motor() {
    const auto there = [&](const char* ours) { return is_mapped(ours) || is_native(ours); };
    if (there("motor_position_rad") || there("motor_velocity_rad_s")) return;
    if (there("current_a") || is_native("output_position_rad") || is_native("output_velocity_rad_s")) return;
    for (ColumnGuess& c : result_.columns) {
      const std::string before = c.ours;
      if (c.why.empty()) continue;
      if (c.ours == "output_position_rad") c.ours = "motor_position_rad";
      if (c.ours == "output_velocity_rad_s") c.ours = "motor_velocity_rad_s";
      if (c.ours == "torque_nm" && !there("motor_torque_nm")) c.ours = "motor_torque_nm";
      result_.joint_side = result_.joint_side || c.ours != before;
    }
  }

  void find_axis(std::optional<data::Axis> stated) {
    if (stated) {
      result_.axis = *stated;
      return;
    }
    for (const ColumnGuess& c : result_.columns)
      if (is_linear_unit(c.unit)) {
        result_.axis = data::Axis::linear;
        result_.axis_why = fmt::format("\"{}\" is in {}", c.theirs, c.unit);
        return;
      }
  }

  const std::vector<std::string>& names_;
  HeaderGuess result_;
};

}  // namespace

std::string unit_in_name(std::string_view name) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}}) {
    const std::size_t from = name.find(open), to = name.rfind(close);
    if (from == std::string_view::npos || to == std::string_view::npos || to < from + 2) continue;
    const std::string inner(name.substr(from + 1, to - from - 1));
    if (data::unit_from_text(inner)) return inner;
  }
  std::vector<std::string> words = words_of(name);
  std::erase(words, "per");
  if (words.size() < 2) return {};
  if (words.size() > 2) {
    const std::string ratio = words[words.size() - 2] + "/" + words.back();
    if (data::unit_from_text(ratio)) return ratio;
  }
  // Before its capitals make two words of mA.
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto tail = std::find_if_not(name.rbegin(), name.rend(), is_letter).base();
  const std::string last(tail, name.end());
  if (last.size() > 1 && tail != name.begin() && data::unit_from_text(last)) return last;
  return unit_of_word(words.back());
}

HeaderGuess guess_columns(const std::vector<std::string>& names, const std::vector<ColumnGuess>& stated,
                          std::optional<data::Axis> axis) {
  return Guesser(names, stated).guess(axis);
}

std::optional<std::string> time_unit_by_values(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < time.size(); ++k) steps.push_back(time[k] - time[k - 1]);
  if (steps.empty()) return std::nullopt;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double step = steps[steps.size() / 2];
  // A drive is sampled at 10 Hz to 20 kHz.
  if (step >= 5e4) return "ns";
  if (step >= 50.0) return "us";
  if (step >= 0.5) return "ms";
  return std::nullopt;
}

std::optional<std::string> velocity_unit_by_values(const std::vector<double>& time_s,
                                                   const std::vector<double>& position_rad,
                                                   const std::vector<double>& velocity) {
  const std::size_t n = std::min({time_s.size(), position_rad.size(), velocity.size()});
  constexpr std::size_t kReach = 5;
  double cross = 0.0, square = 0.0;
  for (std::size_t k = kReach; k + kReach < n; ++k) {
    const double slope =
        (position_rad[k + kReach] - position_rad[k - kReach]) / (time_s[k + kReach] - time_s[k - kReach]);
    if (!std::isfinite(slope) || !std::isfinite(velocity[k])) continue;
    cross += slope * velocity[k];
    square += slope * slope;
  }
  const double factor = square > 0.0 ? cross / square : 0.0;
  const auto is = [&](double wanted) { return std::abs(factor / wanted - 1.0) < 0.03; };
  if (is(30.0 / std::numbers::pi)) return "rpm";
  if (is(180.0 / std::numbers::pi)) return "deg/s";
  if (is(0.5 / std::numbers::pi)) return "rev/s";
  return std::nullopt;
}

}  // namespace flexspline::cli
