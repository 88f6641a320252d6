#include "host/common/signals/cutoff.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "host/common/signals/butterworth.hpp"

namespace flexspline::signals::signals_cutoff_test {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kSampleHz = 1000.0;

std::vector<double> noise(std::size_t n, unsigned seed, double scale = 1.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, scale);
  std::vector<double> x(n);
  for (double& v : x) v = normal(random);
  return x;
}

std::vector<double> sum(std::vector<double> a, const std::vector<double>& b, double factor = 1.0) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += factor * b[i];
  return a;
}

// Motion within a band, and an effort made of it, both measured with noise of their own.
struct Record {
  std::vector<double> effort, motion;
};

Record band_limited(double band_hz, unsigned seed, double scale = 1.0) {
  const std::size_t n = 16000;
  auto motion = ZeroPhaseFilter(10, band_hz, kSampleHz).apply(noise(n, seed, scale));
  const double level = 0.02 * scale * std::sqrt(2.0 * band_hz / kSampleHz);
  return {sum(motion, noise(n, seed + 1, level), 1.0), sum(motion, noise(n, seed + 2, level), 1.0)};
}

TEST(Cutoff, FollowsTheBandOfTheMotion) {
  for (const double band : {8.0, 20.0, 60.0}) {
    const auto record = band_limited(band, 10);
    const auto choice = choose_cutoff(record.effort, record.motion, kSampleHz);
    EXPECT_GT(choice.cutoff_hz, 0.95 * band) << choice.reason;
    EXPECT_LT(choice.cutoff_hz, 1.7 * band) << choice.reason;
    EXPECT_NEAR(choice.coherent_to_hz, band, 0.25 * band);
  }
}

TEST(Cutoff, ReachesTheHarmonicsOfASineThatFrictionMakes) {
  // Velocity of 2 Hz with dry friction: odd harmonics, the amplitude falling as 1/k, seen in both signals.
  std::vector<double> effort(16000), motion(16000);
  for (std::size_t i = 0; i < effort.size(); ++i) {
    const double turn = kTwoPi * 2.0 * static_cast<double>(i) / kSampleHz;
    motion[i] = std::sin(turn) + 0.05 * std::tanh(5.0 * std::sin(turn));
    effort[i] = 0.3 * std::sin(turn) + std::tanh(5.0 * std::sin(turn));
  }
  effort = sum(effort, noise(16000, 20, 0.05));
  motion = sum(motion, noise(16000, 21, 0.005));
  const auto choice = choose_cutoff(effort, motion, kSampleHz);
  EXPECT_GT(choice.cutoff_hz, 10.0) << choice.reason;
  EXPECT_LT(choice.cutoff_hz, 60.0) << choice.reason;
}

TEST(Cutoff, CrossesTheGapFromASineToItsThirdHarmonic) {
  std::vector<double> motion(16000);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const double turn = kTwoPi * 8.0 * static_cast<double>(i) / kSampleHz;
    motion[i] = std::sin(turn) + 0.2 * std::sin(3.0 * turn);
  }
  const auto effort = sum(motion, noise(16000, 24, 0.02));
  motion = sum(motion, noise(16000, 25, 0.02));
  const auto choice = choose_cutoff(effort, motion, kSampleHz);
  EXPECT_GT(choice.coherent_to_hz, 23.0) << choice.reason;
  EXPECT_LT(choice.coherent_to_hz, 30.0) << choice.reason;
}

TEST(Cutoff, StrongNoiseOfTheEffortAloneDoesNotRaiseIt) {
  auto record = band_limited(15.0, 30);
  const auto quiet = choose_cutoff(record.effort, record.motion, kSampleHz);
  record.effort = sum(record.effort, noise(record.effort.size(), 33, 0.3));
  const auto loud = choose_cutoff(record.effort, record.motion, kSampleHz);
  EXPECT_LE(loud.cutoff_hz, 1.3 * quiet.cutoff_hz) << loud.reason;
  EXPECT_GE(loud.cutoff_hz, 0.7 * quiet.cutoff_hz) << loud.reason;
}

TEST(Cutoff, UnrelatedSignalsGetTheLowestBoundOrLittlePower) {
  // 5 % of the bands pass by chance; what they hold must be a small share of the effort's power.
  for (unsigned seed = 40; seed < 60; seed += 2) {
    const auto choice = choose_cutoff(noise(16000, seed), noise(16000, seed + 1), kSampleHz);
    EXPECT_LT(choice.coherent_power, 0.05) << choice.reason;
  }
  const std::vector<double> rest(16000, 0.0);
  const auto choice = choose_cutoff(noise(16000, 60), rest, kSampleHz);
  EXPECT_EQ(choice.cutoff_hz, 5.0);
  EXPECT_NE(choice.reason.find("are not coherent"), std::string::npos);
}

TEST(Cutoff, StaysWithinItsBounds) {
  const auto wide = band_limited(300.0, 70), slow = band_limited(1.0, 80);
  EXPECT_EQ(choose_cutoff(wide.effort, wide.motion, kSampleHz).cutoff_hz, 100.0);
  EXPECT_EQ(choose_cutoff(slow.effort, slow.motion, kSampleHz).cutoff_hz, 5.0);
  EXPECT_EQ(choose_cutoff(slow.effort, slow.motion, 20.0).cutoff_hz <= 2.0, true);
  const auto brief = choose_cutoff(std::vector<double>(50, 1.0), std::vector<double>(50, 1.0), kSampleHz);
  EXPECT_EQ(brief.cutoff_hz, 100.0);
  EXPECT_NE(brief.reason.find("too few"), std::string::npos);
}

TEST(Cutoff, ScaleAndSignOfTheSignalsDoNotMatter) {
  const auto record = band_limited(20.0, 90);
  auto effort = record.effort, motion = record.motion;
  for (double& v : effort) v *= -1024.0;
  for (double& v : motion) v /= 512.0;
  EXPECT_EQ(choose_cutoff(record.effort, record.motion, kSampleHz).cutoff_hz,
            choose_cutoff(effort, motion, kSampleHz).cutoff_hz);
}

TEST(Cutoff, OfSeveralRecordsIsTheMedianOrTheLargestByPower) {
  const std::vector<CutoffChoice> records{{10.0, 8.0, 3.0, "a"},
                                          {40.0, 32.0, 1.0, "b"},
                                          {20.0, 16.0, 3.0, "c"},
                                          {100.0, 80.0, 0.001, "d"},
                                          {5.0, 0.0, 0.0, "e"}};
  const auto median = combine_cutoffs(records);
  EXPECT_EQ(median.cutoff_hz, 20.0);
  EXPECT_DOUBLE_EQ(median.coherent_power, 7.001);
  EXPECT_EQ(combine_cutoffs(records, CutoffCombination::kLargest).cutoff_hz, 40.0);
  const std::vector<CutoffChoice> none{{5.0, 0.0, 0.0, "x"}, {5.0, 0.0, 0.0, "y"}};
  EXPECT_EQ(combine_cutoffs(none).cutoff_hz, 5.0);
  EXPECT_EQ(combine_cutoffs(none, CutoffCombination::kLargest).cutoff_hz, 5.0);
  EXPECT_THROW(combine_cutoffs({}), std::invalid_argument);
}

TEST(Reversals, OfASineAreTwoInAPeriodHoweverCoarseTheEncoder) {
  for (const double quantum : {0.0, 0.01, 0.2}) {
    std::vector<double> position(8000);
    for (std::size_t k = 0; k < position.size(); ++k) {
      const double x = std::sin(kTwoPi * 4.0 * static_cast<double>(k) / kSampleHz);
      position[k] = quantum > 0.0 ? quantum * std::round(x / quantum) : x;
    }
    EXPECT_NEAR(reversals_hz(position, 1.0 / kSampleHz, 0.04), 8.0, 0.2) << quantum;
  }
}

TEST(Reversals, AreNoneWhereNothingTurnsBack) {
  std::vector<double> position(4000);
  EXPECT_EQ(reversals_hz(position, 1e-3, 0.01), 0.0);
  for (std::size_t k = 0; k < position.size(); ++k) position[k] = 1e-3 * static_cast<double>(k);
  EXPECT_EQ(reversals_hz(position, 1e-3, 0.01), 0.0);
  EXPECT_EQ(reversals_hz(std::vector<double>(40, 1.0), 1e-3, 0.01), 0.0);
  EXPECT_THROW(reversals_hz(position, 1e-3, 1e-4), std::invalid_argument);
  EXPECT_THROW(reversals_hz(position, 0.0, 0.01), std::invalid_argument);
}

TEST(Cutoff, SignalsOfUnequalLengthAreRefused) {
  EXPECT_THROW(choose_cutoff(std::vector<double>(1000), std::vector<double>(999), kSampleHz), std::invalid_argument);
  EXPECT_THROW(choose_cutoff(std::vector<double>(1000), std::vector<double>(1000), 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::signals::signals_cutoff_test
