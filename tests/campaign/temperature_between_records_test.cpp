// Friction that changes from record to record with the temperature, where only some of the records have the speeds that
// identify both frictions: torques that are written down.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::temperature_between_records_test {
namespace {

using data::Column;

// What is named of six records at 20 to 50 degrees, when viscous friction is `viscous(record)` times a constant. Half
// of the records go back and forth at one speed.
std::string named(std::uint64_t seed, const std::function<double(int)>& viscous) {
  data::Dataset dataset;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int record = 0; record < 6; ++record) {
    const bool has_one_speed = record >= 2 && record <= 4;
    dataset.experiments.push_back(
        tests::written_experiment(fmt::format("run-{}", record), 4e-3, 5000, [&](double t, data::Experiment& e) {
          // A sine, or tanh(20 sin(t)), whose integral over t is a triangle with round corners.
          const double w = has_one_speed ? 80.0 * std::tanh(20.0 * std::sin(t)) : 80.0 * std::sin(t);
          const double a =
              has_one_speed ? 1600.0 * std::cos(t) / std::pow(std::cosh(20.0 * std::sin(t)), 2.0) : 80.0 * std::cos(t);
          auto& q = e[Column::motor_position];
          const auto& before = e[Column::motor_velocity];
          q.push_back(q.empty() ? 0.0 : q.back() + 2e-3 * (before.back() + w));
          e[Column::motor_velocity].push_back(w);
          e[Column::temperature].push_back(20.0 + 6.0 * record);
          e[Column::motor_torque].push_back(1e-4 * a + 4e-4 * viscous(record) * w + 0.06 * (w > 0.0 ? 1.0 : -1.0) +
                                            2e-3 * noise(random));
        }));
  }
  std::string names;
  for (const NamedEffect& n : diagnose(dataset, tests::plain_model(), {}).named)
    names += fmt::format("{}{}", names.empty() ? "" : " ", n.effect);
  return names;
}

TEST(TemperatureBetweenRecords, IsNamedWhereFrictionFallsWithIt) {
  EXPECT_EQ(named(1, [](int record) { return 1.0 - 0.08 * record; }), "temperature_viscous");
}

TEST(TemperatureBetweenRecords, IsNotNamedWhereFrictionDiffersForAnotherReason) {
  const double as_drawn[] = {1.1, 0.8, 1.0, 1.2, 0.85, 1.05};
  EXPECT_EQ(named(2, [&](int record) { return as_drawn[record]; }), "");
}

}  // namespace
}  // namespace flexspline::selection::temperature_between_records_test
