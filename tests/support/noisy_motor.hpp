// A motor whose velocity is measured with noise, integrated apart from the model library: what tests of estimators need
// to know the truth and the bias.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::tests {

struct NoisyMotor {
  double inertia = 1e-4;             // kg m^2
  double viscous = 3.6e-4;           // N m s/rad
  double coulomb = 0.045;            // N m
  double torque_constant = 0.0543;   // N m/A
  double noise_share = 0.02;         // of the velocity's peak
  double current_noise_share = 0.0;  // of the current's peak
  double sample_s = 1e-3;
  double duration_s = 10.0;
};

// A sum of three sines of current that no friction stops for long. Integrated at a sixteenth of a millisecond with
// exact sticking: over a step the sign is what stops the motion if friction can.
inline data::Experiment noisy_motion(const NoisyMotor& motor, double amplitude_a, double frequency_hz,
                                     std::uint64_t seed) {
  using data::Column;
  constexpr int kSteps = 160;
  const auto n = static_cast<std::size_t>(std::lround(motor.duration_s / motor.sample_s));
  const double step_s = motor.sample_s / kSteps;
  std::vector<double> time(n), current(n), velocity(n);
  double w = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    time[k] = motor.sample_s * static_cast<double>(k);
    velocity[k] = w;
    const double phase = 2.0 * std::numbers::pi * frequency_hz * time[k];
    current[k] = amplitude_a * (std::sin(phase) + 0.7 * std::sin(2.3 * phase + 1.0) + 0.4 * std::sin(5.1 * phase));
    for (int step = 0; step < kSteps; ++step) {
      const double drive = motor.torque_constant * current[k];
      // Implicit in viscous friction; the sign follows from where the free step would go.
      const double mass = motor.inertia / step_s;
      const double free = mass * w + drive;
      const double held = std::clamp(free, -motor.coulomb, motor.coulomb);
      w = (free - held) / (mass + motor.viscous);
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto peak = [](const std::vector<double>& x) {
    double most = 0.0;
    for (const double v : x) most = std::max(most, std::abs(v));
    return most;
  };
  const double velocity_noise = motor.noise_share * peak(velocity);
  const double current_noise = motor.current_noise_share * peak(current);
  for (std::size_t k = 0; k < n; ++k) {
    velocity[k] += velocity_noise * normal(random);
    current[k] += current_noise * normal(random);
  }
  data::Experiment e;
  e.name = "run-" + std::to_string(seed);
  e.sample_s = motor.sample_s;
  e.current_hold = data::CurrentHold::zoh;
  e.current_hold_stated = true;
  e.time_s = time;
  e[Column::current] = current;
  e[Column::motor_velocity] = velocity;
  e.segments = {{0, n}};
  e.masked.assign(n, 0);
  return e;
}

// Inertia, viscous and Coulomb friction, without values.
inline model::Model motor_model(const NoisyMotor& motor) {
  model::Model model;
  model.name = "noisy-motor";
  model.drive.torque_constant_nm_a.value = motor.torque_constant;
  model.drive.gear_ratio.value = 100.0;
  for (const char* type : {"inertia", "viscous_friction", "coulomb_friction"})
    model.effects.push_back(catalogue::blank_effect(catalogue::get(type), model.drive.axis));
  return model;
}

}  // namespace flexspline::tests
