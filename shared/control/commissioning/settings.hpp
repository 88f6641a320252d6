// What commissioning is told, and what it finds. Units: currents in 2^-27 of their full scale, voltages in 2^-28 of the
// full scale of the bus reading, times in PWM periods, angles in 2^-32 turns.
#pragma once

#include <cstdint>

#include "shared/control/foc/modulation.hpp"
#include "shared/control/foc/phase_currents.hpp"

namespace flexspline::control::commissioning {

inline constexpr int kSharesBits = 24;  // of resistance, inductance and flux

enum class Fault : std::uint8_t {
  none,
  bus_too_low,
  offset_too_large,  // of a current sensor; `phase`
  current_flows,     // while all low sides are on: the rotor turns, or readings are noise; `phase`
  short_to_ground,   // `phase`
  current_sum,       // the three currents do not add up to zero, as the sensor of `phase` shows none
  sensor_order,      // a voltage on a phase shows as a current of another one, or with the wrong sign
  overcurrent,
  not_connected,       // at most one phase of the motor is connected
  phase_open,          // `phase`
  phases_shorted,      // two of them; `phase` is the third
  resistances_differ,  // `phase`: the one that differs most
  gains_differ,        // of the current sensors, or current leaves elsewhere
  voltage_too_low,     // the test current is not reached
  rotor_blocked,       // or its load is more than the test current turns
  encoder_stands,      // the rotor turns and the encoder does not
  encoder_slips,       // against the rotor, or its counts per turn are wrong
  wrong_pole_pairs,    // others than stated; `result.pole_pairs` are those measured
  too_far,             // the limit of the travel
  too_long,            // the limit of the time
};

struct Settings {
  foc::SensorSettings sensors;         // offsets are measured; gains are corrected against each other
  foc::ModulationSettings modulation;  // without dead-time compensation
  foc::OffsetCalibration::Limits offsets;
  std::int32_t timer_counts = 0;     // on-time of a duty of one
  std::int32_t least_bus = 0;        // 2^-15
  std::int32_t current = 0;          // of the test
  std::int32_t most_current = 0;     // of a phase
  std::int32_t most_voltage = 0;     // length of the vector
  std::int32_t voltage_ramp = 0;     // a period
  std::int32_t slow_step = 0;        // electrical, a period: at which encoder and rotor are compared
  std::int32_t fast_step = 0;        // at which the flux is measured, unless the next two limit it
  std::int32_t most_shaft_step = 0;  // of the rotor
  std::int32_t step_ramp = 0;        // change of the step a period
  std::int32_t most_travel = 0;      // of the rotor to either side of where it began, 2^-16 turns
  std::int32_t most_periods = 0;
  std::int32_t stated_pole_pairs = 0;  // zero: not stated
};

// A resistance is in full scales of the voltage over that of the current, an inductance in those times a period, a flux
// in voltage full scales times a period for an electrical turn; all in 2^-24.
struct Result {
  Fault fault = Fault::none;
  std::uint8_t phase = 0;  // 1 to 3, of the fault
  foc::Phases gain;        // as SensorSettings has it
  foc::Phases offset;
  std::int32_t resistance = 0;  // of a phase with its switches
  std::int32_t inductance_d = 0;
  std::int32_t inductance_q = 0;
  std::int32_t flux = 0;
  std::int32_t lost_voltage = 0;  // of a leg by dead time and drops
  std::int32_t pole_pairs = 0;
  bool reversed = false;           // the encoder counts against the phases: two of them are swapped
  std::uint32_t offset_angle = 0;  // electrical angle = +-pole_pairs encoder + this
  std::int32_t lag = 0;            // of the rotor behind the test current, by friction: electrical
};

enum class Step : std::uint8_t {
  bus,
  offsets,
  short_to_ground,
  resistance,
  first_inductance,
  pole_pairs,
  forward,
  backward,
  does_it_turn,
  inductances,
  flux_forward,
  flux_backward,
  stop,
  done,
};

}  // namespace flexspline::control::commissioning
