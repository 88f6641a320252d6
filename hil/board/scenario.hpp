#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/board/packed_model.hpp"
#include "hil/board/virtual_drive.hpp"

namespace flexspline::board {

/// Where the output shall be: rad, rad/s, rad/s^2.
struct Reference {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// A motion of the output that a host streams to the drive every millisecond.
struct Scenario {
  std::string_view name;
  std::string_view what;
  Reference (*at)(double time_s);
};
const std::vector<Scenario>& scenarios();
/// Throws std::invalid_argument naming all there are.
const Scenario& scenario(std::string_view name);

struct ScenarioPlan {
  plant::Drive drive{};  ///< what the plant has, and what the drive is told of
  std::string_view scenario = "sine";
  double duration_s = 10.0;
  std::uint64_t seed = 1;
  bool compensation = true;
  std::optional<Injection> injection{};
  double injection_s = 0.0;
  std::optional<PackedModel> packed{};  ///< what the drive is given; else the plant's own values
};

/// What happened. Errors are those of the true output position against the reference, after the first second.
struct ScenarioResult {
  bool compensation = false;
  double rms_error_rad = 0.0;
  double peak_error_rad = 0.0;
  double rms_current_a = 0.0;
  std::uint64_t ticks = 0;
  std::uint64_t frames = 0;
  std::uint64_t telemetry_hash = 0;
  double wall_s = 0.0;
  firmware::Status end{};
};
/// Runs it on the software board, or on `brain`. Throws std::runtime_error where the drive cannot be armed.
ScenarioResult run_scenario(const ScenarioPlan& plan, std::unique_ptr<Brain> brain = nullptr);

/// The names that `--inject` knows.
std::optional<Injection> injection_named(std::string_view name);
std::vector<std::string_view> injection_names();

}  // namespace flexspline::board
