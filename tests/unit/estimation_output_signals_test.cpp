// Which balance identifies what, by what is measured at the gear's output: torques and motions that are written down.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/reversal_mask.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation::estimation_output_signals_test {
namespace {

using data::Column;

constexpr double kRatio = 50.0, kStiffness = 2e4;                 // N m/rad
constexpr double kLoad_nm = 4.0, kOffset_nm = 0.9, kStep = 2e-5;  // of the sensor; of the output encoder, rad

struct Sensors {
  bool has_output_position = false;
};

// Two records under a load that swings; the sensor of the torque reads `kOffset_nm` too much.
data::Dataset loaded_axis(const Sensors& sensors) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 1.0);
  data::Dataset dataset;
  for (const double frequency_hz : {0.4, 0.7}) {
    const double rate = kTurn * frequency_hz;
    dataset.experiments.push_back(
        tests::written_experiment(frequency_hz < 0.5 ? "slow" : "fast", 2e-3, 6000, [&](double t, data::Experiment& e) {
          const double q = 30.0 * std::sin(rate * t), w = 30.0 * rate * std::cos(rate * t), a = -rate * rate * q;
          const double torque = kLoad_nm * std::sin(0.31 * kTurn * t);
          e[Column::motor_position].push_back(q);
          e[Column::motor_torque].push_back(1e-4 * a + 1e-3 * w + 0.05 * (w > 0.0 ? 1.0 : -1.0) + torque / kRatio +
                                            2e-4 * noise(random));
          e[Column::torque].push_back(torque + kOffset_nm + 1e-3 * noise(random));
          if (sensors.has_output_position)
            e[Column::output_position].push_back(kStep * std::round((q / kRatio - torque / kStiffness) / kStep));
        }));
  }
  dataset.drive.gear_ratio = kRatio;
  return dataset;
}

TEST(SensorOffset, IsIdentifiedOnTheMotorBalanceWhereNoTorsionIsMeasured) {
  const auto found = identify(loaded_axis({}), tests::plain_model_with({"torque_offset"}), {});
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

TEST(NoisyTorsion, KeepsItsReversalsWhereAMaskWouldLeaveNothing) {
  // The torsion is 200 urad in all, so that its rate is far below the noise of a difference of two velocities.
  const auto found = identify(loaded_axis({.has_output_position = true}),
                              tests::plain_model_with({"linear_stiffness", "torque_offset"}), {});
  EXPECT_TRUE(found->prepared.pipeline.keep_torsion_reversals);
  const auto stiffness = std::find_if(found->estimates.begin(), found->estimates.end(),
                                      [](const Estimate& e) { return e.effect == "linear_stiffness"; });
  ASSERT_NE(stiffness, found->estimates.end());
  EXPECT_NEAR(stiffness->value, kStiffness, 0.05 * kStiffness);
}

// A locked output, wound up by a slow torque: reversals are as frequent as the transient of a filter for it is long.
data::Dataset wound_up_gear() {
  constexpr double kFrequency_hz = 0.5, kTorque_nm = 10.0;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  data::Dataset dataset;
  dataset.experiments.push_back(tests::written_experiment("locked", 1e-3, 12000, [&](double t, data::Experiment& e) {
    const double torque = kTorque_nm * std::sin(kTurn * kFrequency_hz * t);
    e[Column::motor_position].push_back(kRatio * torque / kStiffness + 2e-5 * noise(random));
    e[Column::output_position].push_back(0.0);
    e[Column::motor_torque].push_back(torque / kRatio + 2e-4 * noise(random));
    e[Column::torque].push_back(torque + 1e-2 * noise(random));
  }));
  dataset.experiments.front().load = data::Load::locked;
  dataset.drive.gear_ratio = kRatio;
  return dataset;
}

TEST(ClearTorsion, GetsACutOffAtWhichTheMaskOfReversalsLeavesEnough) {
  const auto found = identify(wound_up_gear(), tests::plain_model_with({"linear_stiffness"}), {});
  const Pipeline& pipeline = found->prepared.pipeline;
  EXPECT_FALSE(pipeline.keep_torsion_reversals);
  EXPECT_GT(pipeline.row_cutoff_hz, 5.0);
  EXPECT_NE(pipeline.reason.find("leaves samples of the torsion"), std::string::npos) << pipeline.reason;
  EXPECT_FALSE(masks_most_torsion(found->prepared));
  const auto stiffness = std::find_if(found->estimates.begin(), found->estimates.end(),
                                      [](const Estimate& e) { return e.effect == "linear_stiffness"; });
  ASSERT_NE(stiffness, found->estimates.end());
  EXPECT_NEAR(stiffness->value, kStiffness, 0.005 * kStiffness);
}

TEST(ClearTorsion, KeepsACutOffThatTheUserStates) {
  PipelineOptions stated;
  stated.cutoff_hz = 5.0;
  const auto found = identify(wound_up_gear(), tests::plain_model_with({"linear_stiffness"}), stated);
  EXPECT_EQ(found->prepared.pipeline.row_cutoff_hz, 5.0);
}

// Whether too little is left where the mask leaves the first samples of each record, so large a share of them.
bool leaves_too_little(double share) {
  const data::Dataset dataset = loaded_axis({.has_output_position = true});
  PreparedData prepared =
      identify(dataset, tests::plain_model_with({"linear_stiffness", "torque_offset"}), {})->prepared;
  for (Record& r : prepared.records) {
    std::vector<std::size_t>& samples = r.rows[static_cast<std::size_t>(Balance::transmission)].samples;
    samples.clear();
    for (std::size_t k = 0; k < static_cast<std::size_t>(share * static_cast<double>(r.inputs.size()));
         k += r.decimation)
      samples.push_back(k);
  }
  return masks_most_torsion(prepared);
}

TEST(NoisyTorsion, IsOneOfWhichTheMaskLeavesLessThanAFifthOfTheSquares) {
  // The load swings nearly four times in a record, so that the share of the squares is about that of the samples.
  EXPECT_TRUE(leaves_too_little(0.0));
  EXPECT_TRUE(leaves_too_little(0.1));
  EXPECT_FALSE(leaves_too_little(0.3));
  EXPECT_FALSE(leaves_too_little(1.0));
}

// The noise of the torsion's rate where both positions have an error of their own and one that is common to them, as
// time stamps make it; rad, at the output.
double torsion_rate_noise(double common) {
  constexpr double kOwn = 1e-6;
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  data::Dataset dataset;
  dataset.experiments.push_back(tests::written_experiment("free", 2e-3, 6000, [&](double t, data::Experiment& e) {
    const double q = 0.4 * std::sin(0.5 * kTurn * t), of_both = common * noise(random);
    e[Column::motor_position].push_back(kRatio * (q + of_both + kOwn * noise(random)));
    e[Column::output_position].push_back(q + of_both + kOwn * noise(random));
    e[Column::motor_torque].push_back(0.01 * std::cos(0.5 * kTurn * t));
    e[Column::torque].push_back(0.1);
  }));
  dataset.drive.gear_ratio = kRatio;
  PipelineOptions stated;
  stated.cutoff_hz = 20.0;
  const auto found = identify(dataset, tests::plain_model_with({"linear_stiffness"}), stated);
  return found->prepared.records.front().velocity_noise[static_cast<std::size_t>(Balance::transmission)];
}

TEST(NoiseOfTheTorsion, IsNotWhatBothPositionsHaveInCommon) {
  // White noise of the difference, differentiated behind a Butterworth filter of order five in both directions.
  const double cutoff_hz = 20.0, step_hz = 0.01;
  double power = 0.0;  // integral of the spectrum from zero to half the sample rate
  for (double f = 0.5 * step_hz; f < 250.0; f += step_hz)
    power += 2.0 * 2e-3 * step_hz * std::pow(kTurn * f / (1.0 + std::pow(f / cutoff_hz, 10)), 2);
  const double expected = std::sqrt(2.0 * power) * 1e-6;
  EXPECT_NEAR(torsion_rate_noise(0.0), expected, 0.05 * expected);
  EXPECT_NEAR(torsion_rate_noise(1e-4), torsion_rate_noise(0.0), 0.05 * torsion_rate_noise(0.0));
}

}  // namespace
}  // namespace flexspline::estimation::estimation_output_signals_test
