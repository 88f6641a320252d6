#include "host/app/project/column_names.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <initializer_list>
#include <span>
#include <utility>

#include "host/input/data/units.hpp"

namespace flexspline::project {
namespace {

using data::Quantity;
using Words = std::span<const std::string_view>;

constexpr std::string_view kSetPoint[] = {"ref",      "reference", "cmd",     "command", "commanded", "set",
                                          "setpoint", "target",    "desired", "des",     "sp",        "demand",
                                          "soll",     "sollwert",  "goal",    "d"};
constexpr std::string_view kMeasured[] = {"present", "actual", "act",     "meas",     "measured",
                                          "msr",     "ist",    "istwert", "feedback", "fbk"};
constexpr std::string_view kPosition[] = {"position", "pos",    "angle",  "q",      "theta", "phi",       "enc",
                                          "encoder",  "x",      "actpos", "winkel", "lage",  "qm",        "ql",
                                          "thetam",   "thetal", "phim",   "phil",   "alpha", "positions", "angles"};
constexpr std::string_view kVelocity[] = {"velocity", "vel",  "speed",   "omega",    "w",      "qd",
                                          "dq",       "qdot", "rpm",     "erpm",     "dtheta", "wm",
                                          "wl",       "dqm",  "actvelo", "drehzahl", "velo",   "geschwindigkeit",
                                          "dql",      "qdm",  "qdl",     "thetadot", "phidot", "velocities"};

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

Kind kind_of_words(const std::vector<std::string>& words);

bool has_any(const std::vector<std::string>& words, Words wanted) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::find(wanted.begin(), wanted.end(), word) != wanted.end();
  });
}

bool has_any(const std::vector<std::string>& words, std::initializer_list<std::string_view> wanted) {
  return has_any(words, Words(wanted.begin(), wanted.size()));
}

// German writes as one word what English writes as two: "motorposition", "abtriebsmoment".
void split_compounds(std::vector<std::string>& words) {
  for (std::size_t k = 0; k < words.size(); ++k)
    for (const std::string_view first : {"motor", "abtriebs", "abtrieb", "last", "gelenk", "soll", "ist"}) {
      if (!words[k].starts_with(first) || words[k].size() == first.size()) continue;
      const std::string rest = words[k].substr(first.size());
      if (kind_of_words({rest}) == Kind::none) continue;
      words[k] = first;
      words.insert(words.begin() + static_cast<std::ptrdiff_t>(k) + 1, rest);
      break;
    }
}

// Units whose usual spelling has capitals, which names of columns seldom keep.
std::string unit_of_word(const std::string& word) {
  static constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
      {"a", "A"},         {"ma", "mA"},    {"amp", "A"},     {"amps", "A"},     {"n", "N"},         {"kn", "kN"},
      {"nm", "N*m"},      {"mnm", "mN*m"}, {"ncm", "N*cm"},  {"nmm", "N*mm"},   {"knm", "kN*m"},    {"c", "degC"},
      {"degc", "degC"},   {"k", "K"},      {"degf", "degF"}, {"rads", "rad/s"}, {"radps", "rad/s"}, {"degs", "deg/s"},
      {"degps", "deg/s"}, {"mps", "m/s"},  {"seconds", "s"}, {"secs", "s"},     {"degrees", "deg"}, {"radians", "rad"},
      {"grad", "deg"},    {"upm", "rpm"},  {"umin", "rpm"},  {"micros", "us"},  {"nanos", "ns"},    {"millis", "ms"}};
  for (const auto& [spelling, unit] : kSpellings)
    if (spelling == word) return std::string(unit);
  return data::unit_from_text(word) ? word : std::string();
}

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

// "actual_q_3", "position[3]", "q3", "MsrTrq_A3" without the number of the joint.
std::string_view without_index(std::string_view name) {
  const bool bracket = name.ends_with(']');
  std::string_view stem = bracket ? name.substr(0, name.size() - 1) : name;
  const std::size_t digits = stem.size() - (stem.find_last_not_of("0123456789") + 1);
  if (digits == 0 || digits > 2 || digits == stem.size()) return name;
  stem.remove_suffix(digits);
  if (bracket) return stem.ends_with('[') ? stem.substr(0, stem.size() - 1) : name;
  if (stem.size() > 2 && (stem.ends_with("_A") || stem.ends_with("_J"))) return stem.substr(0, stem.size() - 2);
  return stem.ends_with('_') || stem.ends_with('.') ? stem.substr(0, stem.size() - 1) : stem;
}

// A single letter keeps its number: "i1" to "i3" are the currents of phases.
std::vector<std::string> words_without_index(std::string_view name) {
  std::vector<std::string> all = words_of(name), words = words_of(without_index(name));
  const bool is_letter = !words.empty() && words.size() == all.size() && words.back().size() == 1;
  return is_letter && words.back() != "q" ? all : words;
}

std::optional<int> index_of(std::string_view name) {
  const std::string_view stem = without_index(name);
  const std::size_t at = name.find_first_of("0123456789", stem.size());
  int index = 0;
  if (stem.size() == name.size() || at == std::string_view::npos) return std::nullopt;
  std::from_chars(name.data() + at, name.data() + name.size(), index);
  return index;
}

// What is in brackets is a unit and no part of the name.
std::string_view before_brackets(std::string_view name) {
  const std::size_t open = name.find_first_of("[(");
  return open == 0 || open == std::string_view::npos ? name : name.substr(0, open);
}

// "theta_m" and "theta_l" are the textbook's names of motor and link. "pos_m" may be in metres: there the other of the
// two has to be in the file.
Side side_by_letter(const std::string& name, Kind kind, const std::vector<std::string>& names) {
  const std::string_view stem = before_brackets(without_index(name));
  std::vector<std::string> words = words_of(stem);
  std::erase(words, "dot");
  if (words.size() > 2 && !unit_of_word(words.back()).empty() && words.back() != "m") words.pop_back();
  if (words.size() < 2 || (words.back() != "m" && words.back() != "l")) return Side::open;
  const Side side = words.back() == "m" ? Side::motor : Side::link;
  const bool metres_make_no_sense = kind == Kind::velocity || kind == Kind::torque || kind == Kind::current ||
                                    kind == Kind::temperature ||
                                    has_any(words, {"theta", "phi", "q", "angle", "enc", "encoder", "alpha"});
  if (metres_make_no_sense) return side;
  const std::size_t at = stem.find_last_of("mlML");
  std::string other = name;
  other[at] = side == Side::motor ? (other[at] == 'M' ? 'L' : 'l') : (other[at] == 'L' ? 'M' : 'm');
  return std::find(names.begin(), names.end(), other) != names.end() ? side : Side::open;
}

Side side_by_words(const std::vector<std::string>& words) {
  const bool link = has_any(words, {"output",  "out",      "joint", "link",   "load", "arm",    "flange",
                                    "abtrieb", "abtriebs", "last",  "gelenk", "ql",   "thetal", "phil",
                                    "wl",      "dql",      "taul",  "jnt",    "jp",   "jv",     "jt"}) ||
                    (has_any(words, {"actual", "target"}) && has_any(words, {"q", "qd"}));
  const bool motor = has_any(words, {"motor", "mot", "rotor", "wg", "qm", "thetam", "phim", "wm", "dqm", "taum", "im"});
  return motor ? Side::motor : link ? Side::link : Side::open;
}

// What a robot computes from its measured torque and a model of its own: no torque that is known.
bool is_estimate_of_external_torque(const std::vector<std::string>& words) {
  return has_any(words, {"ext", "external"}) &&
         has_any(words, {"hat", "est", "estimate", "estimated", "trq"});  // KUKA's ExtTrq
}

// The torque between motor and link, as texts on joints with an elastic gear and libfranka call it.
bool is_joint_torque(const std::vector<std::string>& words) {
  return words == std::vector<std::string>{"tau", "j"};
}

// "i_q": the letter is an axis of the motor's field, and no angle.
bool is_current_of_axis_q(const std::vector<std::string>& words) {
  return has_any(words, {"q"}) && has_any(words, {"i", "current", "cur", "strom"});
}

// Such texts call the motor's angle theta and the link's q: where both are there, they say which side a column is of.
Side side_by_joint_symbols(const std::vector<std::string>& words, const std::vector<std::string>& names) {
  if (is_joint_torque(words)) return Side::link;
  const auto is_there = [&](const char* symbol) {
    return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      const std::vector<std::string> theirs = words_of(without_index(name));
      return has_any(theirs, {symbol}) && !is_current_of_axis_q(theirs);
    });
  };
  if (is_current_of_axis_q(words)) return Side::open;
  if (!is_there("theta") || !is_there("q")) return Side::open;
  return has_any(words, {"theta", "dtheta"}) ? Side::motor : has_any(words, {"q", "dq"}) ? Side::link : Side::open;
}

Kind kind_of_words(const std::vector<std::string>& words) {
  if (has_any(words,
              {"time", "t", "timestamp", "zeit", "tout", "ts", "stamp", "uhrzeit", "timestamps", "duration", "today"}))
    return Kind::time;
  if (has_any(words, {"temperature", "temp", "temperatur", "temperatures"})) return Kind::temperature;
  // "theta_dot"; the derivative of anything else is no quantity that is used.
  if (has_any(words, {"dot"}))
    return has_any(words, kPosition) && !has_any(words, kVelocity) ? Kind::velocity : Kind::none;
  if (has_any(words, kVelocity)) return Kind::velocity;
  if (has_any(words, {"torque", "force", "tau", "moment", "effort", "trq", "tq", "drehmoment", "taum", "taul",
                      "torques", "efforts"}))
    return Kind::torque;
  if (has_any(words, {"current", "iq", "i", "cur", "amps", "strom", "im", "curr", "currents"})) return Kind::current;
  if (has_any(words, kPosition)) return Kind::position;
  return Kind::none;
}

struct Symbol {
  std::string_view word;
  Kind kind;
};
// Barrett's libraries log position, velocity and torque of the joint so.
constexpr Symbol kJointSymbols[] = {{"jp", Kind::position}, {"jv", Kind::velocity}, {"jt", Kind::torque}};
// Drives with the MIT's protocol log so; elsewhere these letters are power or pressure, and voltage.
constexpr Symbol kMotorSymbols[] = {{"p", Kind::position}, {"v", Kind::velocity}};

// What a name means that is one symbol, perhaps with the word for a set point or a measured value; `names` of all
// columns: p and v count only together and next to tau.
Kind kind_of_symbol(std::vector<std::string> words, const std::vector<std::string>& names) {
  std::erase_if(words, [](const std::string& word) {
    return word != "d" && (has_any({word}, Words(kSetPoint)) || has_any({word}, Words(kMeasured)));
  });
  if (words.size() != 1) return Kind::none;
  for (const Symbol& symbol : kJointSymbols)
    if (words[0] == symbol.word) return symbol.kind;
  const auto is_there = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  for (const Symbol& symbol : kMotorSymbols)
    if (words[0] == symbol.word && is_there("p") && is_there("v") && is_there("tau")) return symbol.kind;
  return Kind::none;
}

// Names of well-known loggers that are always in one unit.
std::string usual_unit(const std::string& name, const std::vector<std::string>& words) {
  // ODrive counts in turns, as moteus does; both document it outside of their files only.
  if (name.ends_with("pos_estimate") || name.ends_with("pos_rel") || name.ends_with("pos_abs")) return "rev";
  if (name.ends_with("vel_estimate")) return "rev/s";
  if (name.find("servo_stats/") != std::string::npos && name.ends_with("/position")) return "rev";
  if (name.find("servo_stats/") != std::string::npos && name.ends_with("/velocity")) return "rev/s";
  return has_any(words, {"erpm"}) ? "rpm" : "";
}

}  // namespace

ColumnReading read_name(const std::string& name, const std::string& stated_unit,
                        const std::vector<std::string>& names) {
  std::vector<std::string> words = words_without_index(name);
  split_compounds(words);
  ColumnReading r;
  r.unit = stated_unit.empty() ? unit_in_name(name) : stated_unit;
  std::string_view base = name;
  if (without_index(base) == base) base = before_brackets(base);
  while (base.ends_with(' ')) base.remove_suffix(1);
  r.joint = index_of(base);
  if (r.unit.empty()) r.unit = usual_unit(name, words);
  r.electrical = has_any(words, {"erpm"});
  const auto unit = data::unit_from_text(r.unit);
  if (has_any(words,
              {"error", "err",     "index", "voltage",      "volt", "volts",  "pwm",       "status", "flag", "mode",
               "acc",   "counter", "accel", "acceleration", "qdd",  "ddq",    "jerk",      "power",  "id",   "duty",
               "tcp",   "battery", "fault", "pose",         "bus",  "wrench", "cartesian", "gyro",   "gnss", "imu",
               "seq",   "nsec",    "nsecs", "gps",          "watt", "mos",    "ddot"}))
    return r;
  r.kind = kind_of_words(words);
  if (r.kind == Kind::none) r.kind = kind_of_symbol(words, names);
  // "T_housing_degC" is no time.
  if (r.kind == Kind::time && unit && unit->quantity == Quantity::temperature) r.kind = Kind::temperature;
  // "q_A" is a current, and no angle.
  if (r.kind == Kind::position && unit && unit->quantity == Quantity::current) r.kind = Kind::current;
  // Of the supply: "current_in"; but "Iq_in_mA".
  if (r.kind == Kind::current && (words.back() == "in" || has_any(words, {"input", "supply", "setup"}))) {
    r.kind = Kind::none;
    r.unit.clear();
    return r;
  }
  if (r.kind == Kind::current && has_any(words, {"q", "iq"})) r.preferred = true;
  if (r.kind == Kind::none && unit) {
    r.kind = kind_of_quantity(unit->quantity);
    r.by_unit_only = true;
  }
  // moteus computes it from the current; VESC's encoder starts again from zero at each turn, too seldom logged to be
  // unwrapped.
  if ((r.kind == Kind::torque && name.find("servo_stats/") != std::string::npos) || name == "encoder_position")
    r.kind = Kind::none;
  // Of the current that makes no torque.
  if (r.kind == Kind::current && has_any(words, {"d"})) r.kind = Kind::none;
  r.set_point = has_any(words, kSetPoint);
  r.measured = !r.set_point && has_any(words, kMeasured);
  r.side = side_by_words(words);
  if (r.side == Side::open) r.side = side_by_letter(name, r.kind, names);
  if (r.side == Side::open) r.side = side_by_joint_symbols(words, names);
  if (unit && kind_of_quantity(unit->quantity) != r.kind) r.unit.clear();
  // The last letter gave the side, so it is not a unit.
  if (r.side == Side::motor && r.unit == "m" && stated_unit.empty() && before_brackets(name).size() == name.size())
    r.unit.clear();
  r.external = has_any(words, {"external", "ext", "disturbance"});
  if (is_estimate_of_external_torque(words)) r.kind = Kind::none;
  r.sensor = is_joint_torque(words) ||
             has_any(words, {"sensor", "transducer", "measured", "msr", "gear", "gearbox", "flexspline"});
  return r;
}

bool counts_samples(const std::string& name) {
  const std::vector<std::string> words = words_of(name);
  return has_any(words, {"sample", "samples", "counter", "count", "index", "tick", "ticks", "nr", "cycle", "cycles"}) &&
         kind_of_words(words) != Kind::time && unit_in_name(name).empty();
}

std::string unknown_unit_in_name(const std::string& name) {
  if (!unit_in_name(name).empty()) return {};
  if (name.ends_with("(%)")) return "%";
  const std::size_t open = name.rfind('[');
  if (open == std::string::npos || open == 0 || !name.ends_with(']')) return {};
  const std::string inner = name.substr(open + 1, name.size() - open - 2);
  const bool is_text = std::any_of(inner.begin(), inner.end(),
                                   [](char c) { return c == '%' || std::isalpha(static_cast<unsigned char>(c)) != 0; });
  return is_text ? inner : std::string();
}

std::string unit_in_name(std::string_view name) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}}) {
    const std::size_t from = name.find(open), to = name.rfind(close);
    if (from == std::string_view::npos || to == std::string_view::npos || to < from + 2) continue;
    const std::string inner(name.substr(from + 1, to - from - 1));
    if (data::unit_from_text(inner)) return inner;
  }
  std::vector<std::string> words = words_of(without_index(name));
  std::erase(words, "per");
  if (words.size() < 2) return {};
  if (words.size() > 2) {
    const std::string ratio = words[words.size() - 2] + "/" + words.back();
    if (data::unit_from_text(ratio)) return ratio;
  }
  // Before its capitals make two words of mA.
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  name = without_index(name);
  const auto tail = std::find_if_not(name.rbegin(), name.rend(), is_letter).base();
  const std::string last(tail, name.end());
  if (last.size() > 1 && tail != name.begin() && data::unit_from_text(last)) return last;
  return unit_of_word(words.back());
}

}  // namespace flexspline::project
