#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hil/board/scenario.hpp"

namespace flexspline::scenario {

/// A scenario for a drive in closed loop: the drive, its motion, its environment and the events. README.md has the
/// format of the files.
struct ScenarioFile {
  std::string name;
  board::Scenario motion;
  double duration_s = 10.0;
  double hold_s = 2.0;
  std::string plant_file;  ///< relative to the scenario's file; empty: the demo's drive
  std::vector<std::string> with{};
  std::string hide;
  double hidden_scale = 1.0;
  double load_torque_nm = 0.0;
  std::vector<double> start_temperature_c{};  ///< one or none
  std::vector<double> amplifier_bandwidth_hz{};
  std::vector<double> amplifier_saturation_a{};
  std::vector<double> amplifier_offset_a{};
  std::vector<board::Event> events{};
};

/// Throws std::runtime_error with origin, line and reason.
ScenarioFile parse_scenario(std::string_view text, std::string_view origin);
/// A file, a built-in one, or a motion of `board::scenarios()`. Throws std::runtime_error with all names.
ScenarioFile find_scenario(const std::string& name_or_file);

struct Known {
  std::string name;
  std::string what;
};
/// All names for `find_scenario`.
std::vector<Known> known_scenarios();

/// The drive of a scenario: its plant file or another one, with the effects that both name.
plant::Drive drive_of(const ScenarioFile& file, const std::string& plant_file,
                      const std::vector<std::string>& more = {}, const std::string& hide = {});
/// The plan of a run except the drive's parameters.
board::ScenarioPlan plan_of(const ScenarioFile& file, const plant::Drive& drive);

}  // namespace flexspline::scenario
