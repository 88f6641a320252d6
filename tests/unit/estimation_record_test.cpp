#include "host/engine/estimation/record.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace flexspline::estimation::estimation_record_test {
namespace {

using data::Column;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSample = 1e-3;

// One sine of position under a torque that follows it, sampled at 1 kHz.
data::Experiment sine(double amplitude, double frequency_hz, double seconds, double quantum = 0.0) {
  data::Experiment e;
  e.name = "sine";
  e.sample_s = kSample;
  e.current_hold = data::CurrentHold::none;
  const double rate = 2.0 * kPi * frequency_hz;
  for (double t = 0.0; t < seconds; t += kSample) {
    const double q = amplitude * std::sin(rate * t);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(quantum > 0.0 ? quantum * std::round(q / quantum) : q);
    e[Column::motor_torque].push_back(0.1 * amplitude * rate * std::cos(rate * t));
  }
  e.segments = {{0, e.size()}};
  return e;
}

data::Experiment still(double seconds) {
  data::Experiment e = sine(0.0, 1.0, seconds);
  e.name = "still";
  return e;
}

Record prepared(const data::Experiment& e, PipelineOptions options = {40.0, true}, model::Drive drive = {}) {
  model::Model model;
  model.drive = std::move(drive);
  return prepare({&e}, model, options).records.front();
}

const std::vector<std::size_t>& motor_rows(const Record& r) {
  return r.rows[index(Balance::motor)].samples;
}

// Widest stretch without rows, in s: what the mask leaves out around a reversal.
double widest_gap(const Record& r) {
  double widest = 0.0;
  const auto& rows = motor_rows(r);
  for (std::size_t k = 1; k < rows.size(); ++k)
    widest = std::max(widest, static_cast<double>(rows[k] - rows[k - 1]) * r.sample_s);
  return widest;
}

TEST(PreparedRecord, DerivesVelocityAndAccelerationOfASineFromItsPosition) {
  const data::Experiment e = sine(10.0, 1.0, 5.0);
  const Record r = prepared(e);
  ASSERT_GT(motor_rows(r).size(), 300u);
  const double rate = 2.0 * kPi;
  for (const std::size_t k : motor_rows(r)) {
    const double t = e.time_s[k];
    // A central difference is short by (rate h)^2 / 6, two of them by twice that.
    EXPECT_NEAR(r.inputs[k].velocity, 10.0 * rate * std::cos(rate * t), 10.0 * rate * 1e-5);
    EXPECT_NEAR(r.inputs[k].acceleration, -10.0 * rate * rate * std::sin(rate * t), 10.0 * rate * rate * 2e-5);
    EXPECT_NEAR(r.inputs[k].direction, std::cos(rate * t) > 0.0 ? 1.0 : -1.0, 1e-12);
    EXPECT_EQ(r.inputs[k].speed, std::abs(r.inputs[k].velocity));
  }
}

TEST(PreparedRecord, ACountIsAPartOfATurnOrOnALinearAxisOfAMetre) {
  data::Experiment e = sine(0.2, 1.0, 5.0);
  e[Column::output_position] = e[Column::motor_position];
  e.encoder_counts = 2e5;
  e.output_encoder_counts = 1e5;
  const Record rotary = prepared(e);
  EXPECT_DOUBLE_EQ(*rotary.motor_quantum, 2.0 * kPi / 2e5);
  EXPECT_DOUBLE_EQ(*rotary.output_quantum, 2.0 * kPi / 1e5);
  model::Drive drive;
  drive.axis = data::Axis::linear;
  const Record linear = prepared(e, {40.0, true}, drive);
  EXPECT_DOUBLE_EQ(*linear.motor_quantum, 1.0 / 2e5);
  EXPECT_DOUBLE_EQ(*linear.output_quantum, 1.0 / 1e5);
}

TEST(PreparedRecord, KeepsFourRowsPerPeriodOfTheCutOff) {
  const data::Experiment e = sine(10.0, 1.0, 5.0);
  EXPECT_EQ(prepared(e, {25.0, true}).decimation, 10u);
  EXPECT_EQ(prepared(e, {50.0, true}).decimation, 5u);
  EXPECT_EQ(prepared(e, {400.0, true}).decimation, 1u);
}

TEST(PreparedRecord, MaskReachesOneAndAHalfPeriodsOfTheCutOffToEachSideOfAReversal) {
  const data::Experiment e = sine(10.0, 1.0, 5.0);
  for (const double cutoff_hz : {20.0, 40.0, 80.0}) {
    const Record r = prepared(e, {cutoff_hz, true});
    const double row_s = kSample * static_cast<double>(r.decimation);
    EXPECT_GE(widest_gap(r), 3.0 / cutoff_hz - 2.0 * kSample) << cutoff_hz;
    EXPECT_LE(widest_gap(r), 3.0 / cutoff_hz + 2.0 * row_s + 3.0 * kSample) << cutoff_hz;
    // Reversals at a quarter and three quarters of each of five periods.
    const auto masked = static_cast<double>(r.rows[index(Balance::motor)].masked);
    EXPECT_NEAR(masked * row_s, 10.0 * 3.0 / cutoff_hz, 10.0 * row_s) << cutoff_hz;
  }
}

TEST(PreparedRecord, MaskGrowsWithTheResolutionOfTheEncoderByItsNoiseInTheVelocity) {
  constexpr double kCutoff = 40.0;
  // White noise of a count, through the filter twice (gain 1 / (1 + r^10)) and a central difference.
  double power = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double f = (i + 0.5) * 0.1;
    const double ratio = std::tan(kPi * f * kSample) / std::tan(kPi * kCutoff * kSample);
    const double gain = std::sin(2.0 * kPi * f * kSample) / kSample / (1.0 + std::pow(ratio, 10.0));
    power += gain * gain / 5000.0;
  }
  const data::Experiment fine = sine(1.0, 0.5, 6.0);
  double before = widest_gap(prepared(fine, {kCutoff, true}));
  for (const double quantum : {2e-3, 1e-2}) {
    const data::Experiment e = sine(1.0, 0.5, 6.0, quantum);
    const Record r = prepared(e, {kCutoff, true});
    const double noise = r.velocity_noise[index(Balance::motor)];
    EXPECT_NEAR(noise / (quantum / std::sqrt(12.0) * std::sqrt(power)), 1.0, 0.2) << quantum;
    for (const std::size_t k : motor_rows(r)) EXPECT_GE(r.inputs[k].speed, 3.0 * noise);
    // Speed is below three times the noise for |t| < 3 noise / acceleration, and the reach comes on top. Noise makes
    // single samples stand below the limit until speed is about twice that.
    const double slow = 2.0 * 3.0 * noise / (kPi * kPi);
    EXPECT_GT(widest_gap(r), before) << quantum;
    EXPECT_GE(widest_gap(r), 3.0 / kCutoff + 0.5 * slow) << quantum;
    EXPECT_LE(widest_gap(r), 3.0 / kCutoff + 2.0 * slow + 0.02) << quantum;
    before = widest_gap(r);
  }
}

TEST(PreparedRecord, WithoutAMaskAllRowsAreKept) {
  const data::Experiment e = sine(10.0, 1.0, 5.0);
  const Record r = prepared(e, {40.0, false});
  EXPECT_EQ(r.rows[index(Balance::motor)].masked, 0u);
  EXPECT_NEAR(widest_gap(r), kSample * static_cast<double>(r.decimation), 1e-12);
}

TEST(PreparedRecord, KeepsARecordWithTheDriveOffAndGivesItNoDirection) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.02, 1e-3);
  data::Experiment e = still(3.0);
  for (double& torque : e[Column::motor_torque]) torque = noise(random);
  for (const auto hold : {data::CurrentHold::none, data::CurrentHold::zoh}) {
    e.current_hold = hold;
    const Record r = prepared(e);
    EXPECT_TRUE(r.at_rest);
    EXPECT_EQ(r.rows[index(Balance::motor)].masked, 0u);
    EXPECT_GT(motor_rows(r).size(), 350u);
    for (std::size_t k = 0; k < r.inputs.size(); ++k) ASSERT_EQ(r.inputs[k].direction, 0.0);
  }
}

TEST(PreparedRecord, KnowsADriveThatIsOffByNoiseThatIsCorrelatedOverSomeSamples) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  int at_rest = 0;
  for (int record = 0; record < 20; ++record) {
    data::Experiment e = still(4.0);
    double noise = normal(random);
    for (double& torque : e[Column::motor_torque]) {
      torque = 0.02 + 1e-3 * noise;
      noise = 0.9 * noise + std::sqrt(1.0 - 0.81) * normal(random);
    }
    e.current_hold = data::CurrentHold::zoh;
    at_rest += prepared(e).at_rest;
  }
  EXPECT_GE(at_rest, 19);
}

TEST(PreparedRecord, AStuckAxisUnderAChangingEffortIsNotAtRestAndIsMasked) {
  data::Experiment e = still(3.0);
  for (std::size_t k = 0; k < e.size(); ++k)
    e[Column::motor_torque][k] = 0.02 * std::sin(2.0 * kPi * 0.7 * e.time_s[k]);
  const Record r = prepared(e);
  EXPECT_FALSE(r.at_rest);
  EXPECT_TRUE(motor_rows(r).empty()) << "friction of a sticking axis is unknown";
  // Nor under noise that is correlated as much as neighbours of a slow effort behind white noise are.
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 0.02 / std::sqrt(20.0));
  for (double& torque : e[Column::motor_torque]) torque += noise(random);
  EXPECT_FALSE(prepared(e).at_rest);
}

TEST(PreparedRecord, AHeldEffortIsPutHalfASampleLater) {
  data::Experiment e = sine(10.0, 1.0, 2.0);
  const std::vector<double> logged = e[Column::motor_torque];
  EXPECT_EQ(prepared(e).effort.values(), logged);
  e.current_hold = data::CurrentHold::zoh;
  const Record r = prepared(e);
  EXPECT_EQ(r.effort[0], logged[0]) << "nothing is known before the first sample";
  for (std::size_t k = 1; k < e.size(); ++k) ASSERT_EQ(r.effort[k], 0.5 * (logged[k] + logged[k - 1]));
}

TEST(PreparedRecord, ACurrentCountsByTheTorqueConstantAndATorqueAsItIs) {
  model::Drive drive;
  drive.torque_constant_nm_a.value = 0.04;
  data::Experiment e = sine(10.0, 1.0, 2.0);
  EXPECT_EQ(prepared(e, {40.0, true}, drive).effort[300], e[Column::motor_torque][300]);
  std::swap(e[Column::motor_torque], e[Column::current]);
  EXPECT_DOUBLE_EQ(prepared(e, {40.0, true}, drive).effort[300], 0.04 * e[Column::current][300]);
}

TEST(PreparedRecord, LeavesOutSamplesThatMustNotBeJudgedAndWhatTheyReach) {
  data::Experiment e = sine(10.0, 1.0, 5.0);
  e.masked.assign(e.size(), 0);
  e.masked[2000] = 1;
  const Record r = prepared(e);
  for (const std::size_t k : motor_rows(r)) EXPECT_GT(std::abs(static_cast<double>(k) - 2000.0), 1.5 / 40.0 / kSample);
}

TEST(PreparedRecord, NothingIsFilteredAcrossAGap) {
  // The same motion, on from a different angle after the gap.
  data::Experiment e = sine(10.0, 1.0, 5.0);
  for (std::size_t k = 2500; k < e.size(); ++k) {
    e[Column::motor_position][k] += 300.0;
    e.time_s[k] += 1.0;
  }
  e.segments = {{0, 2500}, {2500, e.size()}};
  const Record r = prepared(e);
  for (const std::size_t k : motor_rows(r)) EXPECT_LT(r.inputs[k].speed, 10.0 * 2.0 * kPi * 1.001) << k;
}

TEST(Prepare, RefusesACutOffThatTheSampleRateCannotHold) {
  const data::Experiment e = sine(10.0, 1.0, 2.0);
  EXPECT_THROW(prepared(e, {450.0, true}), data::DataError);
  EXPECT_THROW(prepared(e, {0.0, true}), data::DataError);
  EXPECT_NO_THROW(prepared(e, {449.0, true}));
}

TEST(Prepare, SaysWhichColumnsAreMissing) {
  data::Experiment e = sine(10.0, 1.0, 2.0);
  e[Column::motor_torque].clear();
  try {
    prepared(e, {});
    FAIL() << "no effort, no balance";
  } catch (const data::DataError& error) {
    EXPECT_NE(std::string(error.what()).find("current_a"), std::string::npos) << error.what();
  }
}

// Sixteen reversals a second, each of which masks one and a half periods of the cut-off to either side.
TEST(Prepare, ASlowRecordLeavesAFastOneHalfOfItsRows) {
  const data::Experiment slow = sine(400.0, 0.5, 8.0), fast = sine(2.0, 8.0, 8.0);
  EXPECT_LT(prepare({&slow}, {}, {}).pipeline.row_cutoff_hz, 10.0);
  const PreparedData both = prepare({&slow, &fast}, {}, {});
  EXPECT_NEAR(both.pipeline.row_cutoff_hz, 96.0, 2.0) << both.pipeline.reason;
  const Rows& rows = both.records[1].rows[index(Balance::motor)];
  EXPECT_NEAR(static_cast<double>(rows.masked), static_cast<double>(rows.samples.size()),
              0.1 * static_cast<double>(rows.samples.size()));
  EXPECT_NE(both.pipeline.reason.find("between the reversals of sine"), std::string::npos) << both.pipeline.reason;
  EXPECT_LT(prepare({&slow, &fast}, {}, {std::nullopt, false}).pipeline.row_cutoff_hz, 20.0);
}

// 1.1 reversals a second mask two thirds at 5 Hz, and an encoder of which the stroke has nine steps nearly all the
// rest.
TEST(Prepare, ARecordOfWhichTheMaskWouldLeaveNothingRaisesTheCutOffAndPositionsAreFilteredNoWider) {
  constexpr double kStep = 0.01;
  const data::Experiment e = sine(8.0 * kStep, 0.55, 20.0, kStep);
  const auto share = [](const PreparedData& found) {
    const Rows& rows = found.records.front().rows[index(Balance::motor)];
    return static_cast<double>(rows.samples.size()) / static_cast<double>(rows.samples.size() + rows.masked);
  };
  const PreparedData found = prepare({&e}, {}, {}), given = prepare({&e}, {}, {5.0, true});
  EXPECT_EQ(given.pipeline.row_cutoff_hz, 5.0) << "what the user gives stays";
  Pipeline coherent = found.pipeline;  // what the coherence alone gives
  coherent.row_cutoff_hz = 5.0;
  coherent.motion_cutoff_hz = 12.5;
  EXPECT_LT(share(prepare_with({&e}, {}, coherent)), 0.2);
  EXPECT_GT(share(found), 0.3) << found.pipeline.reason;
  EXPECT_NE(found.pipeline.reason.find("the mask leaves samples of sine"), std::string::npos) << found.pipeline.reason;
  EXPECT_LT(found.pipeline.row_cutoff_hz, 40.0);
  EXPECT_LT(found.pipeline.motion_cutoff_hz, 2.0 * found.pipeline.row_cutoff_hz);
}

// Of a sine of 0.94 rad/s the velocity is below 0.1 rad/s for 56 ms to either side of a reversal, and the mask of 5 Hz
// takes 300 ms.
TEST(Prepare, AFrictionLawOfAGivenVelocityKeepsSamplesThatAreAsSlow) {
  const data::Experiment e = sine(0.5, 0.3, 20.0);
  const auto slow_samples = [](const PreparedData& found) {
    const Record& r = found.records.front();
    return std::ranges::count_if(motor_rows(r), [&](std::size_t k) { return std::abs(r.inputs[k].velocity) < 0.1; });
  };
  model::Model law;
  model::Parameter velocity;
  velocity.name = "velocity";
  velocity.value = 0.1;
  law.effects.emplace_back();
  law.effects.front().type = "stribeck_gaussian";
  law.effects.front().parameters = {velocity};
  const PreparedData plain = prepare({&e}, {}, {}), searched = prepare({&e}, law, {});
  EXPECT_EQ(slow_samples(plain), 0);
  EXPECT_EQ(searched.pipeline.row_cutoff_hz, plain.pipeline.row_cutoff_hz)
      << "a velocity that is searched sets nothing";
  law.effects.front().parameters.front().fixed = true;
  const PreparedData found = prepare({&e}, law, {});
  EXPECT_GT(slow_samples(found), 10);
  EXPECT_NE(found.pipeline.reason.find("the mask leaves samples of 0.1 rad/s"), std::string::npos)
      << found.pipeline.reason;
  // The law's information is that of all records together: where others have slow samples, nothing is raised.
  data::Experiment slower = sine(0.2, 0.02, 200.0);
  slower.name = "slower";
  EXPECT_LT(prepare({&e, &slower}, law, {}).pipeline.row_cutoff_hz, found.pipeline.row_cutoff_hz);
}

TEST(PreparedRecord, KalmanDerivativesFollowASineFromACoarseEncoder) {
  constexpr double kStep = 2.0 * kPi / 4000.0;
  const data::Experiment e = sine(5.0, 2.0, 10.0, kStep);
  PipelineOptions options{40.0, true};
  options.derivatives = Derivatives::kalman;
  const Record r = prepared(e, options), filtered = prepared(e);
  ASSERT_GT(r.smoother_corner_hz, 10.0);
  EXPECT_EQ(filtered.smoother_corner_hz, 0.0);
  const double rate = 4.0 * kPi;
  double velocity = 0.0, acceleration = 0.0, filtered_acceleration = 0.0;
  for (const std::size_t k : motor_rows(r)) {
    const double truth = -5.0 * rate * rate * std::sin(rate * e.time_s[k]);
    velocity += std::pow(r.inputs[k].velocity - 5.0 * rate * std::cos(rate * e.time_s[k]), 2);
    acceleration += std::pow(r.inputs[k].acceleration - truth, 2);
    filtered_acceleration += std::pow(filtered.inputs[k].acceleration - truth, 2);
  }
  const auto rows = static_cast<double>(motor_rows(r).size());
  EXPECT_LT(std::sqrt(velocity / rows), 0.002 * 5.0 * rate);
  EXPECT_LT(std::sqrt(acceleration / rows), 0.03 * 5.0 * rate * rate);
  // Within a factor of four of a filter whose cut-off was given.
  EXPECT_LT(acceleration, 16.0 * filtered_acceleration);
}

TEST(Prepare, WithoutACutOffPositionsAreFilteredWiderThanRowsAndTheReasonIsTold) {
  const data::Experiment e = sine(10.0, 1.0, 5.0);
  const Pipeline p = prepare({&e}, {}, {}).pipeline;
  EXPECT_NEAR(p.motion_cutoff_hz, 2.5 * p.row_cutoff_hz, 1e-12);
  EXPECT_FALSE(p.reason.empty());
}

}  // namespace
}  // namespace flexspline::estimation::estimation_record_test
