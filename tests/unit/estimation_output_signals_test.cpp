// Which balance identifies what, by what is measured at the gear's output: torques and motions that are written down.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;

constexpr double kTurn = 6.283185307179586;
constexpr double kRatio = 50.0, kStiffness = 2e4;                 // N m/rad
constexpr double kLoad_nm = 4.0, kOffset_nm = 0.9, kStep = 2e-5;  // of the sensor; of the output encoder, rad

struct Sensors {
  bool has_output_position = false;
  bool has_short_loaded_record = false;  // so that the rate of its torsion is above its noise
};

// Two records under a load that swings; the sensor of the torque reads `kOffset_nm` too much.
data::Dataset loaded_axis(const Sensors& sensors) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 1.0);
  data::Dataset dataset;
  const auto record = [&](const char* name, double frequency_hz, std::size_t samples, double load_nm) {
    const double rate = kTurn * frequency_hz;
    dataset.experiments.push_back(testing::written_experiment(name, 2e-3, samples, [&](double t, data::Experiment& e) {
      const double q = 30.0 * std::sin(rate * t), w = 30.0 * rate * std::cos(rate * t), a = -rate * rate * q;
      const double torque = load_nm * std::sin(0.31 * kTurn * t);
      e[Column::motor_position].push_back(q);
      e[Column::motor_torque].push_back(1e-4 * a + 1e-3 * w + 0.05 * (w > 0.0 ? 1.0 : -1.0) + torque / kRatio +
                                        2e-4 * noise(random));
      e[Column::torque].push_back(torque + kOffset_nm + 1e-3 * noise(random));
      if (sensors.has_output_position)
        e[Column::output_position].push_back(kStep * std::round((q / kRatio - torque / kStiffness) / kStep));
    }));
  };
  record("slow", 0.4, 6000, kLoad_nm);
  record("fast", 0.7, 6000, kLoad_nm);
  if (sensors.has_short_loaded_record) record("loaded", 0.7, 600, 20.0 * kLoad_nm);
  dataset.drive.gear_ratio = kRatio;
  return dataset;
}

TEST(SensorOffset, IsIdentifiedOnTheMotorBalanceWhereNoTorsionIsMeasured) {
  const auto found = identify(loaded_axis({}), testing::plain_model_with({"torque_offset"}), {});
  const auto offset = std::find_if(found->estimates.begin(), found->estimates.end(),
                                   [](const Estimate& e) { return e.effect == "torque_offset"; });
  ASSERT_NE(offset, found->estimates.end());
  EXPECT_NEAR(offset->value, kOffset_nm, 0.02 * kOffset_nm);
  for (const std::string& warning : found->warnings)
    EXPECT_EQ(warning.find("torque_offset"), std::string::npos) << warning;
}

TEST(SensorOffset, StaysOnTheTransmissionBalanceWhereATorsionIsMeasured) {
  const catalogue::Entry& offset = catalogue::get("torque_offset");
  EXPECT_EQ(identified_on(offset, {.torque = true, .torsion = true}), Balance::transmission);
  EXPECT_EQ(identified_on(offset, {.torque = true, .torsion = false}), Balance::motor);
  // A stiffness adds nothing to the motor's balance.
  EXPECT_EQ(identified_on(catalogue::get("linear_stiffness"), {.torque = true, .torsion = false}),
            Balance::transmission);
}

void expect_stiffness_with_reversals(const Sensors& sensors) {
  const auto found =
      identify(loaded_axis(sensors), testing::plain_model_with({"linear_stiffness", "torque_offset"}), {});
  EXPECT_TRUE(found->prepared.pipeline.keep_torsion_reversals);
  const auto stiffness = std::find_if(found->estimates.begin(), found->estimates.end(),
                                      [](const Estimate& e) { return e.effect == "linear_stiffness"; });
  ASSERT_NE(stiffness, found->estimates.end());
  EXPECT_NEAR(stiffness->value, kStiffness, 0.05 * kStiffness);
}

TEST(NoisyTorsion, KeepsItsReversalsWhereAMaskWouldLeaveNothing) {
  // The torsion is 200 urad in all, so that its rate is far below the noise of a difference of two velocities.
  expect_stiffness_with_reversals({.has_output_position = true});
}

TEST(NoisyTorsion, KeepsItsReversalsWhereAMaskWouldLeaveOneShortRecordAlone) {
  expect_stiffness_with_reversals({.has_output_position = true, .has_short_loaded_record = true});
}

}  // namespace
}  // namespace flexspline::estimation
