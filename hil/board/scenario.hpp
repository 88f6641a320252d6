#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/board/events.hpp"
#include "hil/board/motion.hpp"
#include "hil/board/packed_model.hpp"
#include "hil/board/virtual_drive.hpp"

namespace flexspline::board {

/// A motion of the output that a host streams to the drive every millisecond.
struct Scenario {
  std::string name;
  std::string what;
  Motion motion{};
  Reference at(double time_s) const { return motion.at(time_s); }
};
const std::vector<Scenario>& scenarios();
/// Throws std::invalid_argument with all names.
const Scenario& scenario(std::string_view name);

struct ScenarioPlan {
  plant::Drive drive{};  ///< the plant; the drive knows its effects that are not hidden
  std::string scenario = "sine";
  std::optional<Scenario> motion{};  ///< replaces the one that is named
  double duration_s = 10.0;
  /// After the motion the output is held at its set point; the second half shows whether the loops come to rest.
  double hold_s = 0.0;
  std::uint32_t tick_hz = SoftwareBoard::kTickHz;  ///< of the drive; whole ticks in a millisecond
  std::uint64_t seed = 1;
  /// The motor's angle when the drive is switched on, where the motion begins. None: random within two turns, by the
  /// seed.
  std::optional<double> start_turns{};
  bool compensation = true;
  std::optional<Injection> injection{};
  double injection_s = 0.0;
  std::vector<Event> events{};
  double load_torque_nm = 0.0;          ///< on the output all the time, positive resists
  std::optional<PackedModel> packed{};  ///< the drive's parameters; without it the plant's own values
  bool keeps_trace = false;
  bool noise = true;         ///< of the sensors
  bool three_phase = false;  ///< RigSetup::three_phase
};

/// Trace of a run, every millisecond.
struct TracePoint {
  double time_s = 0.0;
  Reference reference{};
  double output_rad = 0.0;  ///< the true one
  double motor_velocity_rad_s = 0.0;
  double torque_nm = 0.0;
  double current_a = 0.0;
  double temperature_c = 0.0;
  double load_torque_nm = 0.0;
  firmware::Mode mode{};
};

/// The result. Errors are those of the true output position against the reference, after the first second.
struct ScenarioResult {
  bool compensation = false;
  double rms_error_rad = 0.0;
  double peak_error_rad = 0.0;
  double rms_current_a = 0.0;
  double peak_current_a = 0.0;
  /// While the set point moves at a tenth of its top speed or more: how often the shaft came to rest (stick and slip).
  int stops = 0;
  /// Amplitude of the output in the second half of the hold, and the number of the motor's reversals there.
  double hold_swing_rad = 0.0;
  int hold_reversals = 0;
  double hold_error_rad = 0.0;  ///< mean over that half
  double final_temperature_c = 0.0;
  std::uint64_t ticks = 0;
  std::uint64_t frames = 0;
  std::uint64_t telemetry_hash = 0;
  double wall_s = 0.0;
  double start_turns = 0.0;  ///< motor angle at power-on
  firmware::Status end{};
  firmware::FaultRecord first_fault{};  ///< of the drive, even where it continued
  std::vector<TracePoint> trace{};

  /// A limit cycle at rest: the shaft keeps reversing, by more than the encoder's counts.
  bool limit_cycle(double count_rad) const { return hold_reversals >= 2 && hold_swing_rad > 2.0 * count_rad; }
};
/// Runs it on the software board, or on `controller`. Throws std::runtime_error where the drive cannot be armed,
/// std::invalid_argument for a tick rate that cannot be simulated.
ScenarioResult run_scenario(const ScenarioPlan& plan, std::unique_ptr<Controller> controller = nullptr);

/// The names for `--inject`.
std::optional<Injection> injection_named(std::string_view name);
std::vector<std::string_view> injection_names();

}  // namespace flexspline::board
