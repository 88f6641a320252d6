// What commissioning found of a three-phase motor and its sensors, and the current loop that was made of it: a section
// of the parameter block. It belongs to the drive: a host that flashes another model keeps it.
#pragma once

#include <cstdint>

#include "shared/control/foc/current_control.hpp"
#include "shared/control/foc/transforms.hpp"

namespace flexspline::control {

struct MotorSettings {
  static constexpr std::uint32_t kMostPolePairs = 40;

  // Electrical angle = +-pole_pairs encoder + offset_angle.
  std::uint32_t pole_pairs = 0;
  bool reversed = false;
  std::uint32_t offset_angle = 0;    // 2^-32 turns
  std::uint32_t encoder_counts = 0;  // a turn, of the encoder that this holds for
  foc::Phases gain;                  // foc::SensorSettings::gain
  foc::CurrentSettings current;
  std::int32_t circle = 0;  // foc::Settings::circle
  // As they were measured, for people and hosts: commissioning::Result.
  std::int32_t resistance = 0;
  std::int32_t inductance_d = 0;
  std::int32_t inductance_q = 0;
  std::int32_t flux = 0;
  std::uint32_t bandwidth_mhz = 0;  // of the current loop, thousandths of a hertz

  template <class Codec>
  constexpr void fields(Codec& c) {
    c.ticks(pole_pairs), c(reversed), c.number(offset_angle), c.counts(encoder_counts);
    for (std::int32_t* x : {&gain.a, &gain.b, &gain.c}) c.positive(*x);
    for (foc::AxisSettings* a : {&current.d, &current.q}) {
      for (std::int32_t* x :
           {&a->proportional, &a->integral, &a->resistance, &a->volts_per_change, &a->change_per_volt})
        c.positive(*x);
      for (std::int32_t* x :
           {&a->half_period_gain_less_one, &a->sample_weight_less_one, &a->pending_gain, &a->reactance})
        c.signed_word(*x);
    }
    for (std::int32_t* x :
         {&current.flux, &current.response_per_period, &current.integral_limit, &current.voltage_exponent, &circle})
      c.positive(*x);
    for (std::int32_t* x : {&resistance, &inductance_d, &inductance_q, &flux}) c.positive(*x);
    c.ticks(bandwidth_mhz);
  }
};

// Beyond the bounds of single fields: what the arithmetic of the current loop stands on.
constexpr bool agrees(const MotorSettings& m) {
  constexpr std::int32_t kLeastGain = 2048, kMostGain = 8191, kLeastExponent = 5, kMostExponent = 25;
  for (const std::int32_t gain : {m.gain.a, m.gain.b, m.gain.c})
    if (gain < kLeastGain || gain > kMostGain) return false;
  for (const foc::AxisSettings* a : {&m.current.d, &m.current.q})
    if (a->half_period_gain_less_one > 0 || a->pending_gain < 0 || a->reactance < 0) return false;
  return m.pole_pairs <= MotorSettings::kMostPolePairs && m.current.voltage_exponent >= kLeastExponent &&
         m.current.voltage_exponent <= kMostExponent;
}

}  // namespace flexspline::control
