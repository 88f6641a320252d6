// Field-oriented control of a three-phase motor: what runs once a PWM period, in the highest interrupt. From the sample
// in the middle of the low sides' time to the on-times that the timer takes over half a period later.
//   readings -> phase currents -> Clarke, Park at the angle of the sample -> current control -> inverse Park at the
//   angle in the middle of the period in which the voltage acts, one period later -> modulation by the bus voltage
// Limits of the set point (current_limits.hpp) run at the divided rate below it.
#pragma once

#include <cstdint>

#include "shared/control/foc/current_control.hpp"
#include "shared/control/foc/modulation.hpp"
#include "shared/control/foc/phase_currents.hpp"
#include "shared/control/foc/transforms.hpp"

namespace flexspline::control::foc {

struct Settings {
  SensorSettings sensors;
  CurrentSettings current;
  ModulationSettings modulation;
  std::int32_t circle =
      0;  // limit of the voltage over the bus voltage, 1/sqrt(3) less a pulse: 2^-26 of the voltage base
};
struct State {
  CurrentState current;
  std::int32_t unmeasured = 0;  // of the sample to come
};
struct Inputs {
  Phases readings;          // 2^-15 of full scale
  std::int32_t bus = 0;     // likewise, below 2^15
  std::uint32_t angle = 0;  // electrical, at the sample, 2^-32 turns
  std::int32_t step = 0;    // of the angle in a period, 2^-32 turns
  RotorVector set_point;    // 2^-27 of the current base
};
struct Outputs {
  Phases counts;          // on-times of the high sides
  RotorVector measured;   // 2^-27 of the current base
  RotorVector wanted;     // voltages before their limit, 2^-25 of the voltage base
  std::int32_t most = 0;  // the circle of the voltage, likewise
};

// Before the switches are armed: from standstill of the integrals, at no current.
constexpr void reset(State& s) {
  s = {};
}
constexpr void update(State& s, const Settings& c, const Inputs& in, Outputs& out) {
  const StatorVector measured = clarke(phase_currents(c.sensors, in.readings, s.unmeasured));
  const Rotation at_sample = rotation(in.angle);
  const RotorVector quarter = park_quarter(measured, at_sample);
  // One by one: compilers build a struct on the stack first.
  out.measured.d = quarter.d * 4;
  out.measured.q = quarter.q * 4;
  const std::int32_t step = saturated_signed<kStepBits>(in.step);
  const std::int32_t bus = in.bus < kLeastBus ? kLeastBus : in.bus;
  const std::int32_t most = fixed::multiply_high(bus << 16, c.circle);
  out.most = most;
  const RotorVector set_point = {saturated_signed<kCurrentBits>(in.set_point.d),
                                 saturated_signed<kCurrentBits>(in.set_point.q)};
  const Voltages u = control_currents(s.current, c.current, set_point, {quarter.d * 4, quarter.q * 4}, step, most);
  out.wanted.d = u.wanted.d;
  out.wanted.q = u.wanted.q;
  const Rotation ahead = rotated(at_sample, step);
  const StatorVector voltage = inverse_park_quarter(u.limited, ahead);
  const StatorVector expected = inverse_park_quarter(u.expected, ahead);
  const Pulses p = modulate(c.modulation, voltage, per_bus(bus), inverse_clarke(expected));
  s.unmeasured = p.unmeasured;
  out.counts.a = p.counts.a;
  out.counts.b = p.counts.b;
  out.counts.c = p.counts.c;
}

}  // namespace flexspline::control::foc
