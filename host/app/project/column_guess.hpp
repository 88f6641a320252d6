// Which columns of a logger's file are which of ours, by names, units and physics.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/app/project/column_names.hpp"
#include "host/input/data/dataset.hpp"
#include "host/input/data/units.hpp"

namespace flexspline::project {

struct LoggedColumn {
  std::string name;
  std::string unit;  // that the file states next to the name; empty where it does not
};

struct ColumnGuess {
  std::string ours;  // "motor_position_rad", or "time_s"
  std::string theirs;
  std::string unit;  // empty: not known, or SI
  std::string why;   // for people; empty where the user said so
  double scale = 1.0;
};

struct GuessOptions {
  std::optional<data::Axis> axis;
  Side position_side = Side::open;  // of the only position or velocity
  std::optional<double> gear_ratio;
  std::optional<int> joint;          // of a file with several, by the number in the names
  std::optional<int> pole_pairs;     // of the motor, for speeds in electrical turns
  std::vector<std::string> without;  // names that are not used
};

struct HeaderGuess {
  std::vector<ColumnGuess> columns;  // those that are not ours by name already
  std::vector<std::string> native;   // those that are
  std::vector<std::string> unused;
  data::Axis axis = data::Axis::rotary;
  std::string axis_why;
  std::optional<Side> side;        // of the only position or velocity, where it is not stated by its name as ours
  bool side_is_asked_for = false;  // it is open, and the gear ratio makes a difference of it
  double scaled_by = 1.0;          // the link's position is used as the motor's, times this
  bool joint_side = false;  // no motor sensors: the output's columns are used as the motor's, with a gear ratio of one
  std::string needs_pole_pairs;  // a speed that is taken for mechanical, though its name says electrical
  std::vector<int> joints;       // numbers of the joints in the file; empty: one
  std::optional<int> joint;      // that was taken
};

// `stated`: columns that the user mapped; they are taken as they are.
HeaderGuess guess_columns(const std::vector<LoggedColumn>& logged, const std::vector<ColumnGuess>& stated,
                          const GuessOptions& options);

// Units that the values give away where the name does not: time by its steps, velocity against the position's slope.
// Returns the unit, or nothing where SI fits or cannot be refuted.
std::optional<std::string> time_unit_by_values(const std::vector<double>& time);
// Velocity over the slope of the position, by least squares; nothing where nothing moves.
std::optional<double> velocity_over_slope(const std::vector<double>& time_s, const std::vector<double>& position_rad,
                                          const std::vector<double>& velocity);
std::optional<std::string> velocity_unit_by_values(const std::vector<double>& time_s,
                                                   const std::vector<double>& position_rad,
                                                   const std::vector<double>& velocity);

}  // namespace flexspline::project
