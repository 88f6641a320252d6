#include "hil/plant/recorder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "hil/plant/excitation.hpp"
#include "hil/plant/physics.hpp"
#include "hil/plant/sensors.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::plant {
namespace {

enum Stream : std::uint64_t { kCurrent = 1, kTorque, kTemperature, kTachometer, kFriction };

/// PI on the true velocity; the integral stops while the current is at its limit.
class VelocityController {
 public:
  VelocityController(const VelocityLoop& gains, double limit_a, double sample_s)
      : gains_(gains), limit_a_(limit_a), sample_s_(sample_s) {}

  double update(double command_rad_s, double velocity_rad_s) {
    const double error = command_rad_s - velocity_rad_s;
    const double integral = integral_a_ + gains_.integral * error * sample_s_;
    const double command = gains_.proportional * error + integral;
    const double limited = std::clamp(command, -limit_a_, limit_a_);
    if (limited == command || (command > limited) != (error > 0.0)) integral_a_ = integral;
    return limited;
  }

 private:
  VelocityLoop gains_;
  double limit_a_;
  double sample_s_;
  double integral_a_ = 0.0;
};

double quantisation_std(int counts) {
  return 2.0 * std::numbers::pi / counts / std::sqrt(12.0);
}

void scale_friction(const Drive& drive, std::uint64_t seed, Record& record, Physics& physics) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  record.viscous_factor = std::max(1.0 + drive.friction_variation * normal(generator), 0.1);
  record.coulomb_factor = std::max(1.0 + drive.friction_variation * normal(generator), 0.1);
  physics.friction.viscous *= record.viscous_factor;
  physics.friction.coulomb *= record.coulomb_factor;
  physics.friction.dahl_torque *= record.coulomb_factor;
  physics.friction.lugre.coulomb *= record.coulomb_factor;
  physics.friction.lugre.static_friction *= record.coulomb_factor;
  physics.friction.lugre.stiffness *= record.coulomb_factor;
}

std::vector<double> per_sample(std::vector<double> rate, double sample_s) {
  for (double& value : rate) value *= sample_s;
  return rate;
}

// The reading of a torque sensor that is on the flexspline and turns with it.
std::vector<double> torque_reading(const SensorErrors& errors, const Record::Truth& truth) {
  std::vector<double> reading = truth.torque_nm;
  for (std::size_t k = 0; k < reading.size(); ++k) {
    reading[k] = errors.torque_gain * reading[k] + errors.torque_offset_nm;
    for (const Ripple& r : errors.torque_ripple) {
      const double phase = r.order * truth.motor_position_rad[k];
      reading[k] += r.cosine * std::cos(phase) + r.sine * std::sin(phase);
    }
  }
  return reading;
}

// With a delayed current two values act from one sample to the next: first that of an earlier sample.
struct LateCurrent {
  double first_a = 0.0;
  double first_s = 0.0;
  double then_a = 0.0;
};
LateCurrent late_current(const std::vector<double>& logged, double delay_s, double sample_s) {
  const double samples = delay_s / sample_s;
  const auto whole = static_cast<std::ptrdiff_t>(samples);
  const auto at = [&](std::ptrdiff_t late) {
    const auto k = static_cast<std::ptrdiff_t>(logged.size()) - 1 - late;
    return logged[static_cast<std::size_t>(std::max<std::ptrdiff_t>(k, 0))];
  };
  return {at(whole + 1), (samples - static_cast<double>(whole)) * sample_s, at(whole)};
}

void measure(const Drive& drive, std::uint64_t seed, std::uint64_t index, Record& record) {
  const Sensors& sensors = drive.sensors;
  const auto noisy = [&](const Sensor& sensor, Stream stream, std::vector<double>& column) {
    const double std = noise_std(sensor, column);
    add_noise(sensor, std, stream_seed(seed, index, stream), column);
    return std;
  };
  // The commanded current is a staircase, so a late reading shows an earlier step, not a slope between two.
  const auto steps_late = static_cast<std::ptrdiff_t>(std::ceil(sensors.current.delay_samples));
  const auto& current = record.truth.current_a;
  const SensorErrors errors = sensor_errors_of(drive);
  const double offset = errors.current_offset_a;
  for (std::size_t k = 0; k < current.size(); ++k) {
    const auto source = static_cast<std::ptrdiff_t>(k) - steps_late;
    record.current_a.push_back((source < 0 ? current.front() : current[static_cast<std::size_t>(source)]) + offset);
  }
  record.current_noise_std = noisy(sensors.current, kCurrent, record.current_a);

  record.torque_nm = torque_reading(errors, record.truth);
  delay(sensors.torque.delay_samples, record.torque_nm);
  record.torque_noise_std = noisy(sensors.torque, kTorque, record.torque_nm);

  record.temperature_c = record.truth.temperature_c;
  delay(sensors.temperature.delay_samples, record.temperature_c);
  record.temperature_noise_std = noisy(sensors.temperature, kTemperature, record.temperature_c);

  if (sensors.has_tachometer) {
    record.motor_velocity_rad_s = record.truth.motor_velocity_rad_s;
    delay(sensors.tachometer.delay_samples, record.motor_velocity_rad_s);
    record.tachometer_noise_std = noisy(sensors.tachometer, kTachometer, record.motor_velocity_rad_s);
  }
  record.motor_position_rad = record.truth.motor_position_rad;
  delay(sensors.motor_delay_samples, per_sample(record.truth.motor_velocity_rad_s, drive.sample_s),
        record.motor_position_rad);
  for (double& q : record.motor_position_rad) q -= errors.torsion_zero_rad * drive.gear_ratio;
  quantise(sensors.motor_counts, record.motor_position_rad);
  record.motor_position_noise_std = quantisation_std(sensors.motor_counts);
  record.output_position_rad = record.truth.output_position_rad;
  delay(sensors.output_delay_samples, per_sample(record.truth.output_velocity_rad_s, drive.sample_s),
        record.output_position_rad);
  quantise(sensors.output_counts, record.output_position_rad);
  record.output_position_noise_std = quantisation_std(sensors.output_counts);
}

// What is true before the plant moves on with these inputs.
void keep_truth(const TwoMass& plant, const Inputs& inputs, Record::Truth& truth) {
  const State& state = plant.state();
  truth.current_a.push_back(inputs.current_a);
  truth.motor_position_rad.push_back(state.motor_angle);
  truth.motor_velocity_rad_s.push_back(state.motor_velocity);
  truth.motor_acceleration_rad_s2.push_back(plant.motor_acceleration(inputs));
  truth.output_position_rad.push_back(state.output_angle);
  truth.output_velocity_rad_s.push_back(state.output_velocity);
  truth.torque_nm.push_back(plant.torque());
  truth.temperature_c.push_back(inputs.temperature_c);
}

// By one sample; a late current changes within it.
void advance(TwoMass& plant, Inputs inputs, const std::vector<double>& current_a, double current_delay_s,
             const Drive& drive) {
  double left_s = drive.sample_s;
  if (current_delay_s > 0.0) {
    const LateCurrent late = late_current(current_a, current_delay_s, drive.sample_s);
    if (late.first_s > 0.0) {
      inputs.current_a = late.first_a;
      plant.advance(inputs, late.first_s, drive.steps_per_sample);
    }
    inputs.current_a = late.then_a;
    left_s = drive.sample_s - late.first_s;
  }
  plant.advance(inputs, left_s, drive.steps_per_sample);
}

}  // namespace

Record record_one(const Drive& drive, const ExperimentPlan& plan, std::uint64_t seed, std::uint64_t index) {
  Record record;
  record.name = plan.name;
  record.locked = plan.locked;
  record.holdout = plan.holdout;
  record.seed = seed;
  record.velocity_mode = plan.mode == Mode::velocity;

  Physics physics = physics_of(drive);
  scale_friction(drive, stream_seed(seed, index, kFriction), record, physics);
  State start;
  if (!plan.locked) {
    start.output_angle = plan.start_output_rad;
    start.motor_angle = plan.start_output_rad * drive.gear_ratio;
  }
  TwoMass plant(std::move(physics), plan.locked, start);
  VelocityController controller(drive.loop, drive.current_limit_a, drive.sample_s);
  const SensorErrors errors = sensor_errors_of(drive);
  const double offset = errors.current_offset_a;
  const auto samples = static_cast<std::size_t>(std::llround(plan.duration_s / drive.sample_s));
  const std::vector<double> set_points = commands(plan, drive.sample_s);
  if (plan.load_torque_nm != 0.0) record.load_torque_nm.assign(samples, plan.load_torque_nm);
  for (std::size_t k = 0; k < samples; ++k) {
    const double time = static_cast<double>(k) * drive.sample_s;
    const State& state = plant.state();
    const double set_point = set_points[k];
    double held = 0.0;
    if (plan.mode == Mode::current) held = std::clamp(set_point, -drive.current_limit_a, drive.current_limit_a);
    if (plan.mode == Mode::velocity) held = controller.update(set_point, state.motor_velocity);
    Inputs inputs;
    // With the drive on, its (biased) reading follows the command.
    inputs.current_a = plan.mode == Mode::off ? 0.0 : held - offset;
    inputs.load_torque_nm = plan.load_torque_nm;
    inputs.temperature_c = plan.temperature_c + plan.temperature_rise_c * time / plan.duration_s;

    record.time_s.push_back(time);
    record.command.push_back(set_point);
    keep_truth(plant, inputs, record.truth);
    advance(plant, inputs, record.truth.current_a, errors.current_delay_s, drive);
  }
  measure(drive, seed, index, record);
  return record;
}

std::vector<Record> record_all(const Drive& drive, const std::vector<ExperimentPlan>& plans, std::uint64_t seed) {
  std::vector<Record> records;
  records.reserve(plans.size());
  for (std::size_t i = 0; i < plans.size(); ++i) records.push_back(record_one(drive, plans[i], seed, i));
  return records;
}

}  // namespace flexspline::plant
