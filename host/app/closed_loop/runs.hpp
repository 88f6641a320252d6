// A drive in closed loop that runs outside of this process (a twin) or in a test: its inputs and its results.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace flexspline::closed_loop {

// The twin's, unless another one is given.
inline constexpr std::uint32_t kTwinTickHz = 20'000;

// One run of one drive.
struct Job {
  std::string scenario;    // name or file
  std::string plant;       // text of a plant file; empty: in `plant_file`
  std::string plant_file;  // empty: the scenario's
  std::vector<std::string> with;
  std::string hide;
  std::vector<std::uint8_t> block;  // that the drive has in its flash memory
  bool compensation = false;
  double seconds = 0.0;  // zero: what the scenario says
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = kTwinTickHz;
  std::string processor;  // firmware image; empty: the software board
  bool keeps_trace = false;
};

// Every millisecond.
struct Trace {
  std::vector<double> time_s, position_command_rad, output_position_rad, error_rad, motor_velocity_rad_s, current_a,
      temperature_c;
};

// Errors are those of the true output position, after the first second of the motion.
struct Outcome {
  std::string what;  // the scenario in words
  double seconds = 0.0;
  double rms_error_rad = 0.0;
  double peak_error_rad = 0.0;
  double rms_current_a = 0.0;
  double peak_current_a = 0.0;
  int stops = 0;             // comes to rest while it shall move
  bool limit_cycle = false;  // oscillates where it should be at rest
  double hold_swing_rad = 0.0;
  std::string fault;  // the first one; empty: none
  bool ends_in_fault = false;
  std::uint64_t ticks = 0;
  double tick_hz = 0.0;
  double realtime_factor = 0.0;
  Trace trace;  // empty unless it was to be kept
};

// Runs all jobs, in any order, and returns their outcomes in theirs. Throws std::runtime_error with the reason where
// one cannot be run.
using Runner = std::function<std::vector<Outcome>(const std::vector<Job>&)>;

// The answer of `flexspline-hil drive --json` on one run, and its trace as CSV. Throw std::runtime_error where they are
// none.
Outcome outcome_of(const nlohmann::json& answer);
Trace trace_of(const std::string& csv);

}  // namespace flexspline::closed_loop
