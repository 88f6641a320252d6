// What the sensors make of what happened.
#include <cmath>

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {
namespace {

constexpr double kTorqueStep_nm = 0.01, kTemperatureStep_c = 0.1, kTemperatureNoise_c = 0.05;

double rounded(double value, double step) {
  return step > 0.0 ? step * std::round(value / step) : value;
}

// The drive's own velocity: filtered where the log is fast, with the noise of differences.
Signal velocity_rpm(const Machine& machine, const Log& log, Dice& dice) {
  const Sensors& s = machine.sensors;
  const double keep = s.sample_hz > 400.0 ? std::exp(-kTurn_rad * 120.0 / s.sample_hz) : 0.0;
  Signal out;
  double filtered = 0.0;
  for (const Sample& now : log) {
    filtered = keep * filtered + (1.0 - keep) * now.velocity_rad_s;
    const double noise = machine.plant.encoder.step_rad * s.sample_hz * 0.05 * dice.normal();
    out.push_back(rounded((filtered + noise) * 60.0 / kTurn_rad, 0.1));
  }
  return out;
}

void measure_output(const Machine& machine, const Log& log, Dice& dice, Measured& m) {
  const Sensors& s = machine.sensors;
  const Signal slow = coloured_noise(log.size(), s.sample_hz, 0.05 * s.sample_hz, dice);
  const double count = s.output_encoder ? kTurn_rad / s.output_encoder_counts : 0.0;
  for (std::size_t k = 0; k < log.size(); ++k) {
    const Sample& now = log[k];
    if (s.output_encoder) {
      const double seen = now.output_angle_rad + output_eccentricity_rad(machine, now);
      m.output_angle_rad.push_back(rounded(seen + 0.3 * count * dice.normal(), count));
    }
    if (s.torque) {
      const double noise = s.torque_noise_nm * (0.8 * dice.normal() + 0.4 * slow[k]);
      const double ripple = s.torque_ripple_nm.at(now.angle_rad);
      m.torque_nm.push_back(rounded(now.gear_torque_nm + s.torque_offset_nm + ripple + noise, kTorqueStep_nm));
    }
    if (s.load_torque)
      m.load_torque_nm.push_back(rounded(now.output_torque_nm + s.torque_noise_nm * dice.normal(), kTorqueStep_nm));
    if (s.temperature)
      m.temperature_c.push_back(rounded(now.temperature_c + kTemperatureNoise_c * dice.normal(), kTemperatureStep_c));
  }
}

}  // namespace

double output_eccentricity_rad(const Machine& machine, const Sample& sample) {
  return machine.sensors.output_eccentricity_rad * std::sin(sample.output_angle_rad + 1.0);
}

Measured measure(const Machine& machine, const Record& record, const Log& log) {
  const Sensors& s = machine.sensors;
  const EncoderParameters& e = machine.plant.encoder;
  Dice dice(record.noise_seed);
  const Signal coloured = coloured_noise(log.size(), s.sample_hz, s.current_corner_hz, dice);
  Measured m;
  for (std::size_t k = 0; k < log.size(); ++k) {
    const Sample& now = log[k];
    const double noise = s.current_noise_a * dice.normal() + s.current_coloured_a * coloured[k];
    m.current_a.push_back(rounded(now.current_a + s.current_offset_a + noise, s.current_step_a));
    const double eccentric = e.eccentricity_rad * std::sin(now.angle_rad + e.eccentricity_phase_rad);
    m.angle_rad.push_back(rounded(now.angle_rad + eccentric + e.noise_rad * dice.normal(), e.step_rad));
  }
  measure_output(machine, log, dice, m);
  if (s.velocity_in_rpm) m.velocity_rpm = velocity_rpm(machine, log, dice);
  return m;
}

}  // namespace flexspline::worlds::machines
