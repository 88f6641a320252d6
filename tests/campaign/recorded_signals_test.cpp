// What a diagnosis makes of signals that are logged beside the motion: temperature, load torque, held-out records.
// Motions, torques and noise are written down here.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::recorded_signals_test {
namespace {

using data::Column;

constexpr double kRatio = 80.0;

// How the drives of a test differ.
struct Drive {
  std::vector<double> temperature = {25.0, 25.0, 25.0, 25.0, 25.0};  // of each record, degC
  std::vector<double> viscous = {1.0, 1.0, 1.0, 1.0, 1.0};           // of each record, over the usual one
  double drag = 0.0;                                                 // of the square of the velocity
  double speed = 1.0;                                                // over the usual one
  double mu = 0.0;                                                   // friction by the load
  double load_nm = 0.0;
  bool logs_load = false;
  unsigned seed = 1;
};

// Inertia, viscous and Coulomb friction and noise; each record on its own sum of sines.
data::Dataset recorded(const Drive& drive) {
  std::mt19937_64 random(drive.seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::uniform_real_distribution<double> draw(0.0, 1.0);
  data::Dataset dataset;
  dataset.drive.gear_ratio = kRatio;
  for (std::size_t r = 0; r < drive.temperature.size(); ++r) {
    std::vector<double> rate, amplitude, phase;
    for (int i = 0; i < 4; ++i) {
      rate.push_back(kTurn * (0.15 + 0.5 * draw(random)));
      amplitude.push_back(drive.speed * 25.0 / rate.back());
      phase.push_back(kTurn * draw(random));
    }
    const auto fill = [&](double t, data::Experiment& e) {
      double q = 0.0, w = 0.0, a = 0.0;
      for (std::size_t i = 0; i < rate.size(); ++i) {
        q += amplitude[i] * std::sin(rate[i] * t + phase[i]);
        w += amplitude[i] * rate[i] * std::cos(rate[i] * t + phase[i]);
        a -= amplitude[i] * rate[i] * rate[i] * std::sin(rate[i] * t + phase[i]);
      }
      const double load = drive.load_nm * (0.3 + std::sin(0.23 * kTurn * t));
      const double sign = w > 0.0 ? 1.0 : -1.0;
      e[Column::motor_position].push_back(q);
      e[Column::temperature].push_back(drive.temperature[r] + 0.05 * noise(random));
      e[Column::motor_torque].push_back(1.2e-4 * a + 8e-4 * drive.viscous[r] * w + 0.05 * sign +
                                        drive.drag * w * w * sign + load / kRatio +
                                        drive.mu * std::abs(load) / kRatio * sign + 1e-3 * noise(random));
      if (drive.logs_load) e[Column::load_torque].push_back(load);
    };
    dataset.experiments.push_back(tests::written_experiment("record-" + std::to_string(r + 1), 4e-3, 5000, fill));
  }
  return dataset;
}

bool names(const Diagnosis& d, std::string_view effect) {
  return std::any_of(d.named.begin(), d.named.end(), [&](const NamedEffect& n) { return n.effect == effect; });
}

TEST(Temperature, ThatFewRecordsGoWithIsNamedWithItsCoefficient) {
  constexpr double kB = 0.02;
  int named = 0;
  for (const unsigned seed : {11U, 12U, 13U}) {
    Drive drive;
    drive.seed = seed;
    drive.temperature = {24.0, 27.0, 30.0, 33.0, 36.0};
    for (std::size_t r = 0; r < drive.viscous.size(); ++r)
      drive.viscous[r] = std::exp(-kB * (drive.temperature[r] - 30.0)) * (1.0 + 0.01 * std::pow(-1.0, r));
    const Diagnosis d = diagnose(recorded(drive), tests::plain_model(), {});
    if (!names(d, "temperature_viscous")) continue;
    ++named;
    EXPECT_NEAR(d.candidates.front().parameters.front().value, kB, 0.3 * kB) << seed;
  }
  EXPECT_EQ(named, 3);
}

TEST(Temperature, ThatRisesWhileFrictionDiffersForOtherReasonsIsNotNamed) {
  const std::vector<double> orders[] = {
      {1.0, 1.12, 0.93, 1.1, 0.97}, {1.0, 0.93, 1.1, 0.97, 1.12}, {1.1, 0.95, 0.9, 1.05, 1.12}};
  for (const std::vector<double>& viscous : orders) {
    Drive drive;
    drive.temperature = {24.0, 27.0, 30.0, 33.0, 36.0};
    drive.viscous = viscous;
    const Diagnosis d = diagnose(recorded(drive), tests::plain_model(), {});
    EXPECT_FALSE(names(d, "temperature_viscous")) << viscous[1];
  }
}

TEST(LoadDependentFriction, IsNamedWhereTheLoadIsLoggedAndThereIsNoTorqueSensor) {
  for (const unsigned seed : {31U, 32U}) {
    Drive drive;
    drive.seed = seed;
    drive.mu = 0.15;
    drive.load_nm = 12.0;
    drive.logs_load = true;
    EXPECT_TRUE(names(diagnose(recorded(drive), tests::plain_model(), {}), "load_dependent_friction")) << seed;
    drive.mu = 0.0;
    EXPECT_TRUE(diagnose(recorded(drive), tests::plain_model(), {}).named.empty()) << seed;
  }
}

TEST(HeldOutRecords, RefuseAnEffectWithWhichTheirErrorRises) {
  for (const bool has_drag : {true, false}) {
    Drive drive;
    drive.drag = 1.5e-5;
    data::Dataset dataset = recorded(drive);
    drive.seed = 2;
    // At four times the speed a drag that is not there shows more than a wrong viscous friction.
    drive.speed = 4.0;
    if (!has_drag) drive.drag = 0.0;
    data::Dataset held_out = recorded(drive);
    for (data::Experiment& e : held_out.experiments) {
      e.name += "-held-out";
      e.role = data::Role::holdout;
      dataset.experiments.push_back(std::move(e));
    }
    const Diagnosis d = diagnose(dataset, tests::plain_model(), {});
    EXPECT_EQ(names(d, "quadratic_drag"), has_drag);
    if (has_drag) continue;
    const auto drag = std::find_if(d.candidates.begin(), d.candidates.end(),
                                   [](const Candidate& c) { return c.effect == "quadratic_drag"; });
    ASSERT_NE(drag, d.candidates.end());
    EXPECT_NE(drag->why_not.find("held out rises"), std::string::npos) << drag->why_not;
  }
}

}  // namespace
}  // namespace flexspline::selection::recorded_signals_test
