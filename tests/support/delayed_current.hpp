// Recordings of an axis whose current acts later than the log says.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "host/input/data/dataset.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::tests {

inline constexpr double kDelayedSampleS = 5e-3, kDelayedNmPerA = 0.05;

// Of an axis with inertia, viscous and Coulomb friction, by `delay_s`, and on the experiment that is held out by
// another delay. Two frequencies in each record: of one alone a lag looks like viscous friction of that record.
inline data::Dataset recorded_with_delay(double delay_s, double noise_a, double held_out_delay_s) {
  constexpr double kRatio = 2.7, kFirst = 30.0, kSecond = 6.0;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, noise_a);
  data::Dataset dataset;
  for (const double hz : {0.3, 0.5, 0.8, 0.6}) {
    const double a = kTurn * hz, b = kRatio * a;
    const auto torque_at = [&](double t) {
      const double velocity = kFirst * a * std::cos(a * t) + kSecond * b * std::cos(b * t);
      const double acceleration = -kFirst * a * a * std::sin(a * t) - kSecond * b * b * std::sin(b * t);
      return 1e-3 * acceleration + 1e-3 * velocity + std::copysign(0.05, velocity);
    };
    const bool is_held_out = hz == 0.6;
    dataset.experiments.push_back(
        written_experiment(std::to_string(hz), kDelayedSampleS, 2000, [&](double t, data::Experiment& e) {
          e[data::Column::motor_position].push_back(kFirst * std::sin(a * t) + kSecond * std::sin(b * t));
          const double later_s = is_held_out ? held_out_delay_s : delay_s;
          e[data::Column::current].push_back(torque_at(t + later_s) / kDelayedNmPerA + noise(random));
        }));
    if (is_held_out) dataset.experiments.back().role = data::Role::holdout;
  }
  return dataset;
}

inline model::Model model_of_delayed_axis() {
  model::Model model = plain_model();
  model.drive.torque_constant_nm_a.value = kDelayedNmPerA;
  return model;
}

}  // namespace flexspline::tests
