// A record of an axis that moves as two sines and a drift, with friction: inertia 1e-3, viscous 4e-3, Coulomb 0.05,
// noise of 1 % of the friction, in SI units.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>

#include "tests/support/written_experiment.hpp"

namespace flexspline::tests {

// `more(t, q)` is a torque that is added.
inline data::Experiment two_sines(double amplitude_rad, double drift_rad_s,
                                  const std::function<double(double t, double q)>& more) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 5e-4);
  return written_experiment("written down", 2e-3, 6000, [&](double t, data::Experiment& e) {
    double q = drift_rad_s * t, w = drift_rad_s, a = 0.0;
    for (const auto& [share, frequency_hz] : {std::pair{0.7, 0.2123}, {0.3, 0.7183}}) {
      const double rate = 2.0 * std::numbers::pi * frequency_hz;
      q += share * amplitude_rad * std::sin(rate * t);
      w += share * amplitude_rad * rate * std::cos(rate * t);
      a -= share * amplitude_rad * rate * rate * std::sin(rate * t);
    }
    e[data::Column::motor_position].push_back(q);
    e[data::Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + std::copysign(0.05, w) + more(t, q) + noise(random));
  });
}

}  // namespace flexspline::tests
