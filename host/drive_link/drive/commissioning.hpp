// Commissioning of a three-phase drive: what it is asked to do, what it found, and the motor's settings from that.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/drive/session.hpp"
#include "shared/protocol/commissioning_payloads.hpp"

namespace flexspline::drive {

struct CommissioningOptions {
  std::optional<double> current_a;         // of the test
  std::optional<double> motor_a;           // that the active block allows the motor; the test takes it by default
  std::optional<double> most_speed_rad_s;  // of the motor
  std::optional<double> bus_v;             // nominal; none: what the drive reads now
  double most_turns = 40.0;                // of the motor to either side
  int pole_pairs = 0;                      // that the motor should have; zero: not stated
};

// What the board states of its three-phase stage. Throws DriveError where it has none, or its firmware is too old.
protocol::CommissioningStage stage_of(Session& session);
// Throws DriveError where an option does not fit the stage: which, and what it may be.
deployment::CommissioningSetup setup_of(const Session& session, const protocol::CommissioningStage& stage,
                                        const control::Hardware& hardware, const CommissioningOptions& options);
// Of the shortest pulse with its dead time, a share of the PWM period.
double pulse_of(const protocol::CommissioningStage& stage);

// Begins, and asks until it is over. `progress` returns false to stop it. Throws DriveError with the reason where the
// drive refuses; if it throws in between, the drive stops by itself within half a second.
protocol::CommissioningProgress commission(Session& session, const deployment::CommissioningSetup& setup,
                                           const std::function<bool(const protocol::CommissioningProgress&)>& progress);
// After it was done.
control::commissioning::Result commissioning_result(Session& session);

// Of several runs on one motor: means; of angles as well.
control::commissioning::Result mean_of(const std::vector<control::commissioning::Result>& results);

// A number that was found, with its standard deviation from run to run.
struct FoundValue {
  std::string name;
  double value = 0.0;
  std::optional<double> spread;  // none for one run
  std::string unit;
};
std::vector<FoundValue> found_values(const deployment::CommissioningSetup& setup,
                                     const std::vector<control::commissioning::Result>& results);

// "phase b" of 1 to 3; empty for none.
std::string phase_name(std::uint8_t phase);
// Name of a state as JSON has it.
std::string_view name_of(protocol::CommissioningState state);
// What a user should know of a motor that was measured. `torque_constant_nm_a`: of the active block, zero without one.
std::vector<std::string> commissioning_warnings(const deployment::CommissioningSetup& setup,
                                                const deployment::CommissioningFindings& found,
                                                const control::Hardware& hardware, double torque_constant_nm_a);

}  // namespace flexspline::drive
