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
inline constexpr std::uint32_t kFaultCount = 20;

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

// What the arithmetic of the steps stands on, whoever asks for it.
constexpr bool valid(const Settings& s) {
  constexpr std::int32_t kFullScale = std::int32_t{1} << 27;
  constexpr std::int32_t kMostVoltage = 72'477'573;  // 0.27 in 2^-28: within the circle at any modulation
  constexpr std::int32_t kMostStep = 42'949'672;     // a hundredth of a turn
  constexpr std::int32_t kMostRamp = 1 << 20;
  constexpr std::int32_t kMostPolePairs = 40;
  const auto within = [](std::int32_t x, std::int32_t low, std::int32_t high) { return x >= low && x <= high; };
  return within(s.current, kFullScale / 64, kFullScale / 2) &&
         within(s.most_current, s.current + s.current / 4, kFullScale - kFullScale / 32) &&
         within(s.most_voltage, 1 << 16, kMostVoltage) && within(s.voltage_ramp, 1, s.most_voltage) &&
         within(s.slow_step, 1, kMostStep / 2) && within(s.fast_step, s.slow_step, kMostStep) &&
         within(s.most_shaft_step, 1, kMostStep) && within(s.step_ramp, 4, kMostRamp) &&
         within(s.most_travel, 1, 32'000 << 16) && within(s.most_periods, 1, INT32_MAX / 2) &&
         within(s.stated_pole_pairs, 0, kMostPolePairs) && within(s.least_bus, foc::kLeastBus, INT16_MAX) &&
         within(s.timer_counts, 64, 1 << 16);
}

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
inline constexpr std::uint32_t kStepCount = 14;

}  // namespace flexspline::control::commissioning
