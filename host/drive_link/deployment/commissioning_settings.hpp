// Numbers of commissioning from SI units, and what it found in SI units.
#pragma once

#include <array>
#include <string_view>

#include "shared/control/commissioning/settings.hpp"
#include "shared/control/motor_settings.hpp"

namespace flexspline::deployment {

struct CommissioningSetup {
  // The board.
  double current_full_scale_a = 0.0;
  double bus_full_scale_v = 0.0;
  double pwm_hz = 20e3;
  int timer_counts = 4200;  // compare value of a duty of one
  double shortest_pulse_s = 0.0;
  double sampling_window_s = 0.0;  // that a low side has to be on for a sample in its middle
  double dead_time_s = 0.0;
  bool two_sensors = false;
  double offset_a = 0.0;  // most that a current sensor's zero may be off
  double spread_a = 0.0;  // most that its readings may differ by at no current
  // The test.
  double current_a = 0.0;
  double most_current_a = 0.0;  // of a phase; zero: one and a half times the test current
  double bus_v = 0.0;           // nominal
  double least_bus_v = 0.0;     // zero: three quarters of the nominal one
  double voltage_share = 0.4;   // of what the modulation can give
  double voltage_ramp_v_s = 20.0;
  double slow_hz = 10.0;            // electrical, at which the encoder is compared with the rotor
  double fast_hz = 100.0;           // electrical, at most, at which the flux is measured
  double most_shaft_hz = 25.0;      // of the motor, then
  double ramp_hz_s = 200.0;         // of the electrical speed; a quarter of it at the slow one
  double most_travel_turns = 60.0;  // of the motor
  double most_time_s = 60.0;
  int pole_pairs = 0;  // as stated; zero: not stated
};
// Throws std::invalid_argument that says which number does not fit.
control::commissioning::Settings commissioning_settings(const CommissioningSetup& setup);

struct CommissioningFindings {
  double resistance_ohm = 0.0;  // of a phase with its switches
  double inductance_d_h = 0.0;
  double inductance_q_h = 0.0;
  double flux_vs = 0.0;
  double lost_v = 0.0;  // of a leg by dead time and drops
  int pole_pairs = 0;
  bool reversed = false;
  double offset_turns = 0.0;     // electrical
  double lag_turns = 0.0;        // electrical
  std::array<double, 3> gain{};  // corrections of the sensors, with the mean one
  std::array<double, 3> offset_a{};
};
CommissioningFindings commissioning_findings(const CommissioningSetup& setup, const control::commissioning::Result& r);

// What a drive keeps of it (the section `motor` of its block), with a current loop of this bandwidth. `pulse`: shortest
// one and dead time, a share of the PWM period. Throws std::invalid_argument that says which number does not fit.
control::MotorSettings motor_settings(const CommissioningSetup& setup, const control::commissioning::Result& r,
                                      double pulse, std::uint32_t encoder_counts, double bandwidth_hz);
// The corner that is taken where none is given.
double usual_bandwidth_hz(double pwm_hz);

/// What a step does, for messages of progress.
std::string_view commissioning_step_text(control::commissioning::Step step);

/// Name of a fault as messages and JSON have it, what it means, and what to do.
struct CommissioningFaultText {
  std::string_view name;
  std::string_view meaning;
  std::string_view cure;
};
CommissioningFaultText commissioning_fault_text(control::commissioning::Fault fault);

}  // namespace flexspline::deployment
