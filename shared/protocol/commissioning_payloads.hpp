// Payloads of the messages of commissioning: a three-phase drive measures its motor. Since minor version 6.
//
// A host asks for the stage, which has the scales of all numbers here, begins, asks for the state until it is over (the
// drive stops where it is not asked any more), and asks for the result.
#pragma once

#include <array>
#include <cstdint>

#include "shared/control/commissioning/settings.hpp"
#include "shared/protocol/message.hpp"

namespace flexspline::protocol {

// Answer to `commissioning_stage`: what the board states of its power stage, and the motor in use.
struct CommissioningStage {
  std::uint32_t current_full_scale_ma = 0;  // of a phase
  std::uint32_t bus_full_scale_mv = 0;
  std::uint32_t pwm_hz = 0;
  std::uint32_t timer_counts = 0;   // on-time of a duty of one
  std::int32_t shortest_pulse = 0;  // 2^-30 of a period
  std::int32_t most_current = 0;    // of a phase, 2^-27 of full scale
  std::uint16_t bus = 0;            // now, 2^-15 of full scale
  std::uint16_t least_bus = 0;      // at which it runs
  std::uint16_t most_bus = 0;
  std::uint32_t encoder_counts = 0;  // a turn
  bool two_sensors = false;
  std::uint8_t pole_pairs = 0;  // zero: the motor was never measured
  bool reversed = false;
  std::uint32_t offset_angle = 0;  // electrical angle = +-pole_pairs encoder + this, 2^-32 turns
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(current_full_scale_ma), c(bus_full_scale_mv), c(pwm_hz), c(timer_counts), c(shortest_pulse), c(most_current);
    c(bus), c(least_bus), c(most_bus), c(encoder_counts), c(two_sensors), c(pole_pairs), c(reversed), c(offset_angle);
  }
  bool operator==(const CommissioningStage&) const = default;
};

// `commissioning_begin`: control::commissioning::Settings without what the board states. Answered as a command is.
struct CommissioningBegin {
  std::int32_t least_bus = 0;
  std::int32_t current = 0;
  std::int32_t most_current = 0;
  std::int32_t most_voltage = 0;
  std::int32_t voltage_ramp = 0;
  std::int32_t slow_step = 0;
  std::int32_t fast_step = 0;
  std::int32_t most_shaft_step = 0;
  std::int32_t step_ramp = 0;
  std::int32_t most_travel = 0;
  std::int32_t most_periods = 0;
  std::int32_t stated_pole_pairs = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(least_bus), c(current), c(most_current), c(most_voltage), c(voltage_ramp), c(slow_step), c(fast_step);
    c(most_shaft_step), c(step_ramp), c(most_travel), c(most_periods), c(stated_pole_pairs);
  }
  bool operator==(const CommissioningBegin&) const = default;
};

// Whether it runs, and how it ended. All switches are open in every state but `runs`.
enum class CommissioningState : std::uint8_t {
  none,  // not since the drive was switched on
  runs,
  done,         // the motor was measured
  fault,        // it found `fault`
  stopped,      // by a request
  host_lost,    // no request came
  drive_fault,  // a protection of the drive; its status has the fault
  bus_high,     // the bus voltage rose above its limit
};
inline constexpr std::uint32_t kCommissioningStates = 8;

// Answer to `commissioning_state`.
struct CommissioningProgress {
  CommissioningState state = CommissioningState::none;
  control::commissioning::Step step = control::commissioning::Step::bus;  // the present one, or that in which it ended
  control::commissioning::Fault fault = control::commissioning::Fault::none;
  std::uint8_t phase = 0;  // 1 to 3, of the fault; zero: it is of none
  std::uint32_t periods = 0;
  std::uint32_t most_periods = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(state, kCommissioningStates), c.within(step, control::commissioning::kStepCount);
    c.within(fault, control::commissioning::kFaultCount), c.within(phase, 4), c(periods), c(most_periods);
  }
  bool operator==(const CommissioningProgress&) const = default;
};

// Answer to `commissioning_result`: control::commissioning::Result, once the state is `done`.
struct CommissioningResult {
  std::array<std::int32_t, 3> gain{};
  std::array<std::int32_t, 3> offset{};
  std::int32_t resistance = 0;
  std::int32_t inductance_d = 0;
  std::int32_t inductance_q = 0;
  std::int32_t flux = 0;
  std::int32_t lost_voltage = 0;
  std::uint8_t pole_pairs = 0;
  bool reversed = false;
  std::uint32_t offset_angle = 0;
  std::int32_t lag = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(gain), c(offset), c(resistance), c(inductance_d), c(inductance_q), c(flux), c(lost_voltage);
    c(pole_pairs), c(reversed), c(offset_angle), c(lag);
  }
  bool operator==(const CommissioningResult&) const = default;
};

}  // namespace flexspline::protocol
