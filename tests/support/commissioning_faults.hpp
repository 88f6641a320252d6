// Faults of wiring, sensors and load for commissioning, each drawn at random, with the name that it has to get.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "tests/support/commissioning_rig.hpp"

namespace flexspline::commissioning_rig {

using commissioning::Fault;

struct FaultCase {
  Fault fault = Fault::none;
  int phase = 0;  // 1 to 3, or zero: none is named
  Bench bench;
  deployment::CommissioningSetup setup;
};

// Those that a bench can have.
inline constexpr Fault kBenchFaults[] = {
    Fault::bus_too_low,    Fault::offset_too_large, Fault::current_flows,      Fault::short_to_ground,
    Fault::current_sum,    Fault::sensor_order,     Fault::not_connected,      Fault::phase_open,
    Fault::phases_shorted, Fault::gains_differ,     Fault::resistances_differ, Fault::voltage_too_low,
    Fault::rotor_blocked,  Fault::encoder_stands,   Fault::encoder_slips,      Fault::wrong_pole_pairs,
    Fault::too_far,        Fault::too_long};

namespace detail {
// Faults of the electrical side; true where it was one.
inline bool add_electrical(FaultCase& c, std::size_t leg, std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
  };
  Bench& b = c.bench;
  const std::size_t next = (leg + 1) % 3, last = (leg + 2) % 3;
  switch (c.fault) {
    case Fault::bus_too_low:
      b.inverter.supply_v = uniform(15.0, 34.0);
      return true;
    case Fault::offset_too_large:
      b.sensors.offset_a[leg] = uniform(2.1, 10.0) * (random() % 2 == 0 ? 1.0 : -1.0);
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::current_flows:
      b.sensors.noise_a = uniform(0.6, 2.0);
      c.phase = 1;
      return true;
    case Fault::short_to_ground:
      b.wiring.ground_ohm = uniform(0.005, 0.5);
      b.wiring.ground_leg = leg;
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::current_sum:
      b.sensors.gain[leg] = 0.0;
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::sensor_order:
      if (random() % 3 == 0)
        b.sensors.gain = {-1.0, -1.0, -1.0};
      else
        std::swap(b.sensors.order[leg], b.sensors.order[next]);
      return true;
    case Fault::not_connected:
      b.wiring.open = {true, true, true};
      b.wiring.open[leg] = random() % 2 == 0;
      return true;
    case Fault::phase_open:
      b.wiring.open[leg] = true;
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::phases_shorted:
      b.wiring.short_ohm = b.motor.resistance_ohm * uniform(0.01, 0.1);
      b.wiring.short_from = next;
      b.wiring.short_to = last;
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::gains_differ:
      b.sensors.gain[leg] *= random() % 2 == 0 ? uniform(1.4, 1.6) : uniform(0.55, 0.65);
      return true;
    case Fault::resistances_differ:
      b.wiring.contact_ohm[leg] = b.motor.resistance_ohm * uniform(0.6, 2.0);
      c.phase = static_cast<int>(leg) + 1;
      return true;
    case Fault::voltage_too_low:
      b.motor.resistance_ohm = uniform(1.5, 6.0);
      return true;
    default:
      return false;
  }
}
}  // namespace detail

inline FaultCase random_fault(Fault fault, std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
  };
  FaultCase c;
  c.fault = fault;
  c.bench = random_bench(random);
  c.setup = setup_of(c.bench);
  Bench& b = c.bench;
  if (detail::add_electrical(c, static_cast<std::size_t>(random() % 3), random)) return c;
  switch (fault) {
    case Fault::rotor_blocked:
      b.shaft.blocked = true;
      break;
    case Fault::encoder_stands:
      b.encoder.stands = true;
      break;
    case Fault::encoder_slips:
      b.encoder.slip_turns = uniform(20.0, 90.0) / 360.0;
      b.encoder.slip_every_turns = uniform(0.3, 0.8);
      break;
    case Fault::wrong_pole_pairs:
      c.setup.pole_pairs = b.motor.pole_pairs + (random() % 2 == 0 ? 1 : -1);
      break;
    case Fault::too_far:
      c.setup.most_travel_turns = uniform(0.05, 0.5);
      break;
    case Fault::too_long:
      c.setup.most_time_s = uniform(0.2, 3.0);
      break;
    default:
      break;
  }
  return c;
}

inline std::string name_of(Fault fault) {
  return std::string(deployment::commissioning_fault_text(fault).name);
}

}  // namespace flexspline::commissioning_rig
