// Numbers of field-oriented control from SI units: gains from R, L, flux and a bandwidth.
#pragma once

#include "shared/control/foc/current_limits.hpp"
#include "shared/control/foc/field_oriented.hpp"

namespace flexspline::deployment {

// How the current loop takes out an error of its model (shared/control/foc/current_control.hpp).
struct Corrections {
  double proportional = 0.0;  // share of an error that is taken out within a period
  double integral = 0.0;      // share of it that is added to that, period by period
  double extrapolated = 0.0;  // B: how much more of a new error is expected half a period later
};
// Those with which the rise of a step is the design's within 10 % where R and L are wrong by 20 %.
Corrections usual_corrections(double pwm_hz, double bandwidth_hz);

struct FocSetup {
  // Of a phase, in star connection; the flux is the amplitude of its linkage.
  double resistance_ohm = 0.0;
  double inductance_d_h = 0.0;
  double inductance_q_h = 0.0;
  double flux_vs = 0.0;
  // The board.
  double current_full_scale_a = 0.0;  // a reading of one, and the current base
  double bus_full_scale_v = 0.0;
  double pwm_hz = 20e3;
  int timer_counts = 4200;        // compare value of a duty of one
  double dead_time_s = 0.0;       // to be compensated; zero: none
  double dead_time_zone_a = 0.0;  // current from which a leg loses all of it
  double diode_drop_v = 0.0;      // of a leg that rests in its dead time
  double bus_v = 0.0;             // at which that drop is taken
  double shortest_pulse_s = 0.0;
  double sampling_window_s = 0.0;  // that a low side has to be on for a sample in its middle
  // The design.
  double bandwidth_hz = 1000.0;  // corner of the response to a set point
  Corrections corrections;       // all zero: those of the PWM rate over the bandwidth
};
// Throws std::invalid_argument that says which number does not fit.
control::foc::Settings foc_settings(const FocSetup& setup);

struct FocLimitSetup {
  double peak_a = 0.0;
  double continuous_a = 0.0;
  double thermal_s = 0.0;       // time constant of the winding
  double fade_from = 0.8;       // share of the continuous heating at which the peak begins to go
  double rate_hz = 10e3;        // of the motion loops
  double weakening_a = 0.0;     // most negative current in d
  double weakening_hz = 20.0;   // corner of the voltage loop at `highest_speed`
  double highest_speed = 0.0;   // electrical, rad/s
  double voltage_share = 0.95;  // of the circle
};
control::foc::LimitSettings foc_limits(const FocSetup& setup, const FocLimitSetup& limits);

}  // namespace flexspline::deployment
