#include "host/app/project/column_guess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace flexspline::project {
namespace {

using data::Quantity;

std::string ours_for(const ColumnReading& r, bool other_effort) {
  const bool link = r.side == Side::link;
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
      return r.set_point ? "position_command_rad" : link ? "output_position_rad" : "motor_position_rad";
    case Kind::velocity:
      return r.set_point ? "velocity_command_rad_s" : link ? "output_velocity_rad_s" : "motor_velocity_rad_s";
    case Kind::torque:
      if (r.set_point) return {};
      if (r.external) return "load_torque_nm";
      if (link || r.sensor) return "torque_nm";
      return r.side == Side::motor || !other_effort ? "motor_torque_nm" : "torque_nm";
  }
  return {};
}

// What a name says its numbers are parts of: "1 %", or "1 per mille" (CiA 402 has torques and currents so); empty:
// none.
std::string_view ratio_in(std::string_view name) {
  const auto has = [&](std::initializer_list<std::string_view> any) {
    return std::any_of(any.begin(), any.end(), [&](std::string_view part) { return name.find(part) != name.npos; });
  };
  if (has({"[%]", "(%)", "_percent", "_pct"})) return "1 %";
  if (has({"permille", "per_mille", "Permille", "PerMille", "promille", "Promille"})) return "1 per mille";
  return {};
}

std::string reason(const std::string& theirs, const ColumnReading& r) {
  static constexpr std::string_view kNames[] = {"",           "a time",     "a current",    "a torque or force",
                                                "a position", "a velocity", "a temperature"};
  const std::string_view kind = kNames[static_cast<std::size_t>(r.kind)];
  std::string text = fmt::format("\"{}\" reads as {}{}{}", theirs, kind, r.set_point ? ", a set point" : "",
                                 r.side == Side::link    ? ", of the output"
                                 : r.side == Side::motor ? ", of the motor"
                                                         : "");
  if (r.by_unit_only) text += ", by its unit alone";
  if (!r.unit.empty()) return text;
  if (const std::string_view one = ratio_in(theirs); !one.empty())
    return text + fmt::format(
                      "; a ratio to a rated value that the file does not have, taken as SI: state the size of {} "
                      "as its unit, as in --map motor_torque_nm={}:\"0.125 N*m\" where 12.5 N*m are {}",
                      one, theirs, one == "1 %" ? "100 %" : "100 per mille");
  return text + "; no unit in its name, taken as SI";
}

bool is_linear_unit(const std::string& text) {
  const auto unit = data::unit_from_text(text);
  return unit && (unit->quantity == Quantity::length || unit->quantity == Quantity::velocity ||
                  unit->quantity == Quantity::force);
}

bool is_motion(const ColumnGuess& c) {
  return c.ours == "motor_position_rad" || c.ours == "motor_velocity_rad_s" || c.ours == "output_position_rad" ||
         c.ours == "output_velocity_rad_s";
}

class Guesser {
 public:
  Guesser(const std::vector<LoggedColumn>& logged, const std::vector<ColumnGuess>& stated, const GuessOptions& options)
      : options_(options) {
    for (const LoggedColumn& column : logged) names_.push_back(column.name);
    for (const LoggedColumn& column : logged) readings_[column.name] = read_name(column.name, column.unit, names_);
    for (const ColumnGuess& column : stated) result_.columns.push_back(column);
  }

  HeaderGuess guess() {
    for (const std::string& name : names_)
      if (is_ours(name) && !is_mapped(name)) result_.native.push_back(name);
    choose_joint();
    bool current = is_mapped("current_a") || is_native("current_a");
    for (const std::string& name : names_)
      current = current || (is_free(name) && readings_[name].kind == Kind::current);
    // Names that say more come first: the current of the q axis, then what is measured or of the motor. A unit alone is
    // the weakest sign.
    std::vector<std::string> by_preference = names_;
    const auto rank = [&](const std::string& name) {
      const ColumnReading& r = readings_[name];
      return r.preferred ? 2 : r.measured || r.side == Side::motor ? 1 : 0;
    };
    std::stable_sort(by_preference.begin(), by_preference.end(),
                     [&](const std::string& a, const std::string& b) { return rank(a) > rank(b); });
    for (const bool by_unit_only : {false, true})
      for (const std::string& name : by_preference)
        if (is_free(name)) take(name, by_unit_only, current);
    for (const std::string& name : names_)
      if (is_free(name)) take_side_of_sensor(name);
    for (const std::string& name : names_)
      if ((is_free(name) || (is_left_out(name) && !is_source(name))) && !name.empty()) result_.unused.push_back(name);
    find_axis();
    find_side();
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
  bool is_there(const std::string& ours) const { return is_mapped(ours) || is_native(ours); }
  bool is_source(const std::string& name) const {
    return std::any_of(result_.columns.begin(), result_.columns.end(),
                       [&](const ColumnGuess& c) { return c.theirs == name; });
  }
  bool is_free(const std::string& name) const { return !is_ours(name) && !is_source(name) && !is_left_out(name); }
  bool is_left_out(const std::string& name) const {
    return std::find(options_.without.begin(), options_.without.end(), name) != options_.without.end();
  }

  // Positions or velocities with numbers are those of several joints; one of them is used.
  void choose_joint() {
    std::set<int> joints;
    for (const auto& [name, r] : readings_)
      if (r.joint && !r.set_point && (r.kind == Kind::position || r.kind == Kind::velocity)) joints.insert(*r.joint);
    if (joints.size() < 2 && !options_.joint) return;
    result_.joints.assign(joints.begin(), joints.end());
    if (joints.empty()) return;
    joint_ = options_.joint ? *options_.joint : joint_of_stated(joints).value_or(*joints.begin());
    result_.joint = joint_;
  }
  // The joint of a column that is stated: those of another one do not belong to it.
  std::optional<int> joint_of_stated(const std::set<int>& joints) {
    for (const ColumnGuess& column : result_.columns)
      if (const auto joint = readings_[column.theirs].joint; joint && joints.contains(*joint)) return joint;
    return std::nullopt;
  }

  void take(const std::string& name, bool by_unit_only, bool current) {
    const ColumnReading& r = readings_[name];
    if (r.by_unit_only != by_unit_only) return;
    if (joint_ && r.joint && r.kind != Kind::time && *r.joint != *joint_) return;
    const bool effort = current || is_there("motor_torque_nm");
    const std::string ours = ours_for(r, effort);
    if (ours.empty() || is_there(ours)) return;
    const double scale = r.electrical ? 1.0 / options_.pole_pairs.value_or(1) : 1.0;
    if (r.electrical && !options_.pole_pairs) result_.needs_pole_pairs = name;
    result_.columns.push_back({ours, name, r.unit, reason(name, r), scale});
  }

  // A position or velocity whose name says no side, next to one that says that it is the motor's, is of the output
  // where its first word is that of the torque sensor: "ankle_pos" with "motor_pos" and "ankle_torque".
  void take_side_of_sensor(const std::string& name) {
    const ColumnReading& r = readings_[name];
    if ((r.kind != Kind::position && r.kind != Kind::velocity) || r.side != Side::open || r.set_point) return;
    const auto first_word = [](const std::string& text) { return text.substr(0, text.find_first_of("_. ")); };
    const auto is_of = [&](std::string_view ours, auto&& fits) {
      return std::any_of(result_.columns.begin(), result_.columns.end(),
                         [&](const ColumnGuess& c) { return c.ours == ours && fits(c); });
    };
    const auto says_motor = [&](const ColumnGuess& c) { return readings_[c.theirs].side == Side::motor; };
    const auto is_same_part = [&](const ColumnGuess& c) { return first_word(c.theirs) == first_word(name); };
    if (!is_of("torque_nm", is_same_part)) return;
    if (!is_of("motor_position_rad", says_motor) && !is_of("motor_velocity_rad_s", says_motor)) return;
    ColumnReading of_output = r;
    of_output.side = Side::link;
    const std::string ours = ours_for(of_output, true);
    if (!is_there(ours)) result_.columns.push_back({ours, name, r.unit, reason(name, of_output), 1.0});
  }

  void find_axis() {
    if (options_.axis) {
      result_.axis = *options_.axis;
      return;
    }
    for (const ColumnGuess& c : result_.columns)
      if (is_linear_unit(c.unit)) {
        result_.axis = data::Axis::linear;
        result_.axis_why = fmt::format("\"{}\" is in {}", c.theirs, c.unit);
        return;
      }
  }

  // Which side of the gear the only position (or velocity) is of. Sides that the file's own names or the user state
  // stay.
  void find_side() {
    bool motor = is_native("motor_position_rad") || is_native("motor_velocity_rad_s");
    bool link = is_native("output_position_rad") || is_native("output_velocity_rad_s");
    bool open = false;
    for (const ColumnGuess& c : result_.columns) {
      if (!is_motion(c)) continue;
      const bool guessed = !c.why.empty();
      (c.ours.starts_with("motor") ? motor : link) = true;
      open = open || (guessed && readings_[c.theirs].side == Side::open);
    }
    if (!motor && is_stated_link_with_gear()) return take_motor_of_link();
    const bool one_side = motor != link && (is_mapped_motion());
    if (!one_side) return;
    Side side = link ? Side::link : open ? Side::open : Side::motor;
    if (options_.position_side != Side::open) side = options_.position_side;
    result_.side = side;
    if (side == Side::open && options_.gear_ratio && *options_.gear_ratio != 1.0) result_.side_is_asked_for = true;
    if (side != Side::link) return set_motor_columns(1.0);
    const double ratio = options_.gear_ratio.value_or(1.0);
    if (ratio == 1.0 && is_native("output_position_rad")) return;
    set_motor_columns(ratio);
    result_.joint_side = ratio == 1.0;
    result_.scaled_by = ratio;
  }

  bool is_stated_link_with_gear() const {
    const bool is_native_link = is_native("output_position_rad") || is_native("output_velocity_rad_s");
    return is_native_link && !is_mapped_motion() && options_.position_side == Side::link &&
           options_.gear_ratio.value_or(1.0) != 1.0;
  }
  // The file's own columns of the output stay; the motor's are those times the gear ratio.
  void take_motor_of_link() {
    const double ratio = *options_.gear_ratio;
    for (const auto& [ours, theirs] : {std::pair{"motor_position_rad", "output_position_rad"},
                                       std::pair{"motor_velocity_rad_s", "output_velocity_rad_s"}})
      if (is_native(theirs))
        result_.columns.push_back(
            {ours, theirs, "", fmt::format("\"{}\" times the gear ratio {:g}, as stated", theirs, ratio), ratio});
    result_.side = Side::link;
    result_.scaled_by = ratio;
  }

  bool is_mapped_motion() const {
    return std::any_of(result_.columns.begin(), result_.columns.end(),
                       [&](const ColumnGuess& c) { return is_motion(c) && may_be_moved(c); });
  }

  // What the user mapped stays where it was put, unless the user says too that it is measured at the link.
  bool may_be_moved(const ColumnGuess& c) const { return !c.why.empty() || options_.position_side == Side::link; }

  // The motor's columns from those of the link, times the gear ratio: between them there is only the gear.
  void set_motor_columns(double scale) {
    for (ColumnGuess& c : result_.columns) {
      if (!may_be_moved(c)) continue;
      const bool position = c.ours == "output_position_rad" || c.ours == "motor_position_rad";
      const bool velocity = c.ours == "output_velocity_rad_s" || c.ours == "motor_velocity_rad_s";
      if (position) c.ours = "motor_position_rad";
      if (velocity) c.ours = "motor_velocity_rad_s";
      if (position || velocity || c.ours == "position_command_rad" || c.ours == "velocity_command_rad_s")
        c.scale *= scale;
      // A torque of the joint, where there is no other effort.
      if (c.ours == "torque_nm" && !c.why.empty() && !is_there("motor_torque_nm") && !is_there("current_a")) {
        c.ours = "motor_torque_nm";
        c.scale = 1.0 / scale;
      }
    }
  }

  GuessOptions options_;
  std::vector<std::string> names_;
  std::map<std::string, ColumnReading> readings_;
  std::optional<int> joint_;
  HeaderGuess result_;
};

}  // namespace

HeaderGuess guess_columns(const std::vector<LoggedColumn>& logged, const std::vector<ColumnGuess>& stated,
                          const GuessOptions& options) {
  return Guesser(logged, stated, options).guess();
}

std::optional<std::string> time_unit_by_values(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < time.size(); ++k) steps.push_back(time[k] - time[k - 1]);
  if (steps.empty()) return std::nullopt;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const auto unit = data::unit_of_time_step(steps[steps.size() / 2]);
  return unit ? std::optional(std::string(*unit)) : std::nullopt;
}

std::optional<double> velocity_over_slope(const std::vector<double>& time_s, const std::vector<double>& position_rad,
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
  return square > 0.0 ? std::optional(cross / square) : std::nullopt;
}

std::optional<std::string> velocity_unit_by_values(const std::vector<double>& time_s,
                                                   const std::vector<double>& position_rad,
                                                   const std::vector<double>& velocity) {
  const double factor = velocity_over_slope(time_s, position_rad, velocity).value_or(0.0);
  const auto is = [&](double wanted) { return std::abs(factor / wanted - 1.0) < 0.03; };
  if (is(30.0 / std::numbers::pi)) return "rpm";
  if (is(180.0 / std::numbers::pi)) return "deg/s";
  if (is(0.5 / std::numbers::pi)) return "rev/s";
  return std::nullopt;
}

}  // namespace flexspline::project
