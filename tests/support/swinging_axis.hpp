// An axis that swings, with presliding, on a motion and a torque that are written down.
#pragma once

#include <cmath>
#include <random>

#include "tests/support/written_experiment.hpp"

namespace flexspline::tests {

inline constexpr double kSwingingDry_nm = 0.05, kSwingingNoise_nm = 5e-4;

// Strokes of several rad with an inertia, viscous friction, and dry friction that builds up over a travel (Dahl's law:
// exact along each step).
inline data::Dataset swinging_axis(double travel_rad, double encoder_step_rad = 0.0) {
  using data::Column;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, kSwingingNoise_nm);
  data::Dataset dataset;
  for (const double frequency_hz : {0.21, 0.34}) {
    double z = 1.0, before = 0.0;
    const double rate = 6.283185307179586 * frequency_hz;
    dataset.experiments.push_back(
        written_experiment(frequency_hz < 0.3 ? "slow" : "fast", 2e-3, 6000, [&](double t, data::Experiment& e) {
          const double q = 3.0 * std::sin(rate * t), w = 3.0 * rate * std::cos(rate * t);
          const double end = q >= before ? 1.0 : -1.0;
          z = end + (z - end) * std::exp(-std::abs(q - before) / travel_rad);
          before = q;
          e[Column::motor_position].push_back(
              encoder_step_rad > 0.0 ? encoder_step_rad * std::round(q / encoder_step_rad) : q);
          e[Column::motor_torque].push_back(-1e-3 * rate * rate * q + 4e-3 * w + kSwingingDry_nm * z + noise(random));
        }));
  }
  return dataset;
}

}  // namespace flexspline::tests
