// Commissioning on the twin's motor, power stage, shaft and encoder, one PWM period at a time; and random motors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "hil/motor/power_stage.hpp"
#include "hil/motor/shaft.hpp"
#include "hil/motor/shunts.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "shared/control/commissioning/commissioning.hpp"

namespace flexspline::commissioning_rig {

namespace commissioning = control::commissioning;

struct Bench {
  motor::MotorParameters motor;
  motor::InverterParameters inverter;
  motor::SensorParameters sensors;
  motor::WiringParameters wiring;
  motor::ShaftParameters shaft;
  motor::EncoderParameters encoder;
  double start_turns = 0.0;  // of the rotor
};

inline deployment::CommissioningSetup setup_of(const Bench& b) {
  deployment::CommissioningSetup s;
  s.current_full_scale_a = b.sensors.full_scale_a;
  s.bus_full_scale_v = b.sensors.bus_full_scale_v;
  s.pwm_hz = b.inverter.pwm_hz;
  s.dead_time_s = b.inverter.dead_time_s;
  s.shortest_pulse_s = 0.2e-6;
  s.sampling_window_s = 1.5e-6;
  s.offset_a = 2.0;
  s.spread_a = 2.0;
  s.current_a = 10.0;
  s.bus_v = 48.0;
  return s;
}

struct Outcome {
  commissioning::Result result;
  commissioning::Step step = commissioning::Step::bus;  // in which it ended
  deployment::CommissioningFindings found;
  double time_s = 0.0;
  double most_current_a = 0.0;  // of a phase of the motor
  double travel_turns = 0.0;    // of the rotor, at most
  double temperature_c = 20.0;  // of the winding in the end
};

// `fidelity`: the switched model is some ten times slower.
inline Outcome commission(const Bench& b, const deployment::CommissioningSetup& setup,
                          motor::Fidelity fidelity = motor::Fidelity::averaged, std::uint64_t seed = 7) {
  motor::PowerStage stage(b.motor, b.inverter, b.sensors, fidelity, b.wiring);
  motor::Shunts shunts(b.sensors, seed);
  motor::Shaft shaft(b.shaft, b.motor.pole_pairs);
  motor::ShaftEncoder encoder(b.encoder);
  shaft.set_turns(b.start_turns);
  stage.motor().stop(shaft.electrical().angle);
  commissioning::Commissioning control;
  control.begin(deployment::commissioning_settings(setup));
  const double period = stage.period_s();
  Outcome o;
  motor::Triple duties{};
  // The drive is off in the first period.
  for (; !control.done();) {
    const motor::Rotor at = shaft.electrical();
    const motor::Sample sample = stage.run(duties, at);
    const double before = shaft.turns();
    shaft.step(sample.torque_nm, period);
    const motor::Readings r = shunts.read(sample);
    commissioning::Inputs in;
    in.readings = {r.current[0], r.current[1], r.current[2]};
    in.bus = r.bus;
    in.encoder = encoder.read((before + shaft.turns()) / 2.0);
    o.step = control.step();
    const commissioning::Outputs out = control.update(in);
    const double all = setup.timer_counts;
    duties = {out.counts.a / all, out.counts.b / all, out.counts.c / all};
    o.most_current_a = std::max(o.most_current_a, std::hypot(sample.current.d, sample.current.q));
    o.travel_turns = std::max(o.travel_turns, std::abs(shaft.turns() - b.start_turns));
  }
  o.result = control.result();
  o.found = deployment::commissioning_findings(setup, o.result);
  o.time_s = control.periods() * period;
  o.temperature_c = stage.motor().temperature_c();
  return o;
}

// R, L and flux each 0.3 to 3 times those of the class that a strain-wave joint has; everything else drawn as well.
inline Bench random_bench(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
  };
  const auto spread = [&] { return 0.3 * std::pow(10.0, uniform(0.0, 1.0)); };
  Bench b;
  b.motor.resistance_ohm = 0.3 * spread();
  b.motor.inductance_d_h = 0.3e-3 * spread();
  b.motor.inductance_q_h = b.motor.inductance_d_h * std::pow(2.0, uniform(-1.0, 1.0));
  b.motor.flux_vs = 0.006 * spread();
  b.motor.pole_pairs = 2 + static_cast<int>(random() % 20);
  const double torque = 1.5 * b.motor.pole_pairs * b.motor.flux_vs * 10.0;
  b.motor.cogging_nm = torque * uniform(0.0, 0.02);
  b.motor.cogging_per_turn = 6.0 * b.motor.pole_pairs;
  b.inverter.dead_time_s = uniform(0.2e-6, 1.0e-6);
  b.inverter.averaged_steps = 4;
  for (std::size_t x = 0; x < 3; ++x) {
    b.sensors.offset_a[x] = uniform(-1.0, 1.0);
    b.sensors.gain[x] = uniform(0.97, 1.03);
  }
  b.sensors.noise_a = uniform(0.01, 0.1);
  if (random() % 2 == 0) std::swap(b.wiring.motor_phase[1], b.wiring.motor_phase[2]);
  b.encoder.reversed = random() % 2 == 0;
  b.encoder.offset_turns = uniform(0.0, 1.0);
  b.shaft.inertia_kg_m2 = torque / uniform(2000.0, 10000.0);
  b.shaft.coulomb_nm = torque * uniform(0.05, 0.25);
  b.shaft.viscous_nms = torque * uniform(0.0, 0.1) / 150.0;
  b.start_turns = uniform(-1.0, 1.0);
  return b;
}

// What all three gains have in common, by which the sensors' currents are the true ones once they are corrected against
// each other.
inline double common_gain(const Bench& b) {
  const motor::Triple& g = b.sensors.gain;
  return 3.0 / (1.0 / g[0] + 1.0 / g[1] + 1.0 / g[2]);
}
// Electrical angle of the rotor at encoder zero, in turns, as the phases are wired.
inline double true_offset_turns(const Bench& b) {
  const bool swapped = b.wiring.motor_phase[1] == 2;
  // encoder = +-rotor + offset; electrical = +-p rotor.
  const double rotor = (b.encoder.reversed ? 1.0 : -1.0) * b.encoder.offset_turns;
  const double electrical = b.motor.pole_pairs * rotor * (swapped ? -1.0 : 1.0);
  return electrical - std::floor(electrical);
}

}  // namespace flexspline::commissioning_rig
