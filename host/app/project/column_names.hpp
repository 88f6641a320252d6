// What the name of a logger's column says: which quantity, of which side of the gear, in which unit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::project {

enum class Kind : std::uint8_t { none, time, current, torque, position, velocity, temperature };
// Of the gear. `open`: the name does not say.
enum class Side : std::uint8_t { open, motor, link };

struct ColumnReading {
  Kind kind = Kind::none;
  Side side = Side::open;
  bool by_unit_only = false;
  bool set_point = false;
  bool measured = false;  // "actual", "present"
  bool external = false;
  bool sensor = false;
  bool preferred = false;   // of several of its kind: the current that makes torque
  bool electrical = false;  // a speed in electrical turns
  std::string unit;
  std::optional<int> joint;  // "actual_q_3", "position[3]": of a file with several joints
};

// `names`: all of the file; what ends with "_m" is the motor's where one with "_l" is there, too, or where metres would
// make no sense. `stated_unit`: in the file next to the name.
ColumnReading read_name(const std::string& name, const std::string& stated_unit, const std::vector<std::string>& names);

// The unit that a name ends with, in brackets or after an underscore: "speed [rpm]", "position_mm", "i_ma".
std::string unit_in_name(std::string_view name);

// What stands in square brackets at the end of a name and is no unit that is known, or "%"; empty: nothing.
std::string unknown_unit_in_name(const std::string& name);

// Whether a name counts samples, as "Sample" or "cycle_counter" does, and is no time.
bool counts_samples(const std::string& name);

}  // namespace flexspline::project
