// Which columns of a logger's file are which of ours, by names, units and physics.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/data/dataset.hpp"
#include "host/data/units.hpp"

namespace flexspline::cli {

struct ColumnGuess {
  std::string ours;  // "motor_position_rad", or "time_s"
  std::string theirs;
  std::string unit;  // empty: not known, or SI
  std::string why;   // for people; empty where the user said so
};

struct HeaderGuess {
  std::vector<ColumnGuess> columns;  // those that are not ours by name already
  std::vector<std::string> native;   // those that are
  std::vector<std::string> unused;
  data::Axis axis = data::Axis::rotary;
  std::string axis_why;
  bool joint_side = false;  // no motor sensors: the output's columns stand for the motor's, with a gear ratio of one
};

// `stated`: columns that the user mapped; they are taken as they are. `axis`: stated by the user.
HeaderGuess guess_columns(const std::vector<std::string>& names, const std::vector<ColumnGuess>& stated,
                          std::optional<data::Axis> axis);

// The unit that a name ends with, in brackets or after an underscore: "speed [rpm]", "position_mm", "i_ma".
std::string unit_in_name(std::string_view name);

// Units that the values give away where the name does not: time by its steps, velocity against the position's slope.
// Returns the unit, or nothing where SI fits or cannot be refuted.
std::optional<std::string> time_unit_by_values(const std::vector<double>& time);
std::optional<std::string> velocity_unit_by_values(const std::vector<double>& time_s,
                                                   const std::vector<double>& position_rad,
                                                   const std::vector<double>& velocity);

}  // namespace flexspline::cli
