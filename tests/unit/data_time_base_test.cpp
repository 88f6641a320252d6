// host/input/data: the uniform time base, gaps, and resampling.
#include "host/input/data/time_base.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_time_base_test {
namespace {

std::vector<double> jittered_times(std::size_t count, double share) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.5 * share, 0.5 * share);
  std::vector<double> times = even_times(count);
  for (double& t : times) t += 0.001 * uniform(random);
  return times;
}

TEST(TimeBase, RoundedTimeStampsAreUniformAndTheSampleTimeIsTheMeanStep) {
  std::vector<double> times;
  for (int k = 0; k < 20000; ++k) times.push_back(1e-8 * std::round(1e8 * k / 3000.0));
  const TimeBase base = time_base(times);
  EXPECT_TRUE(base.uniform());
  EXPECT_NEAR(base.sample_s, 1.0 / 3000.0, 1e-12);
  EXPECT_EQ(base.segments.size(), 1u);
}

TEST(TimeBase, CountsLostSamplesIntoTheSampleTime) {
  std::vector<double> times;
  for (int k = 0; k < 1000; ++k)
    if (k % 50 != 20 && k % 100 != 21) times.push_back(0.002 * k);
  const TimeBase base = time_base(times);
  EXPECT_FALSE(base.uniform());
  EXPECT_NEAR(base.sample_s, 0.002, 1e-12);
  EXPECT_EQ(base.lost_samples, 30u);
  EXPECT_EQ(base.segments.size(), 1u);
}

TEST(TimeBase, SegmentsEndAtGaps) {
  std::vector<double> times = even_times(300);
  for (std::size_t k = 100; k < 300; ++k) times[k] += 0.5;
  for (std::size_t k = 250; k < 300; ++k) times[k] += 2.0;
  const TimeBase base = time_base(times);
  ASSERT_EQ(base.segments.size(), 3u);
  EXPECT_EQ(base.segments[1].first, 100u);
  EXPECT_EQ(base.segments[1].last, 250u);
  EXPECT_NEAR(base.longest_gap_s, 2.001, 1e-9);
  EXPECT_NEAR(base.longest_gap_at_s, 0.749, 1e-9);
}

TEST(TimeBase, AFileWithAGapLoadsAsSegmentsWithAWarning) {
  std::vector<double> times = even_times(1000);
  for (std::size_t k = 400; k < 1000; ++k) times[k] += 0.3;
  const TestFolder folder;
  const Dataset data = load({folder.write("gap.csv", csv_of(times, good_columns()))});
  ASSERT_EQ(of_kind(data.findings, "gap").size(), 1u);
  EXPECT_EQ(of_kind(data.findings, "gap")[0].severity, Severity::warning);
  const Experiment& e = data.experiments[0];
  ASSERT_EQ(e.segments.size(), 2u);
  EXPECT_EQ(e.segments[0].last, 400u);
  EXPECT_EQ(e.segments[1].last, 1000u);
}

TEST(TimeBase, SmallJitterIsResampledOntoTheTruthAndSaid) {
  const TestFolder folder;
  const Dataset data = load({folder.write("jitter.csv", csv_of(jittered_times(2000, 0.1), good_columns()))});
  ASSERT_EQ(of_kind(data.findings, "jitter").size(), 1u);
  EXPECT_EQ(of_kind(data.findings, "jitter")[0].severity, Severity::warning);
  const Experiment& e = data.experiments[0];
  EXPECT_NEAR(static_cast<double>(e.size()), 2000.0, 1.0);
  for (std::size_t k = 0; k < e.size(); ++k) {
    ASSERT_NEAR(e.time_s[k] - e.time_s[0], e.sample_s * static_cast<double>(k), 1e-9);
    ASSERT_NEAR(e[Column::motor_position][k], position(e.time_s[k]), 2e-5);
    ASSERT_NEAR(e[Column::motor_velocity][k], velocity(e.time_s[k]), 2e-4);
    EXPECT_NEAR(e[Column::current][k], current(e.time_s[k]), 5e-4) << k << " " << e.time_s[k];
  }
}

TEST(TimeBase, LargeJitterIsAnErrorUnlessTolerated) {
  const TestFolder folder;
  const std::filesystem::path file = folder.write("jitter.csv", csv_of(jittered_times(2000, 0.8), good_columns()));
  const std::vector<Finding> errors = errors_of({file});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "jitter");
  EXPECT_NE(errors[0].remedy.find("--tolerate jitter"), std::string::npos);
  const Dataset data = load({file}, tolerating("jitter"));
  const Experiment& e = data.experiments[0];
  for (std::size_t k = 0; k < e.size(); ++k) ASSERT_NEAR(e[Column::motor_position][k], position(e.time_s[k]), 2e-4);
}

TEST(TimeBase, ALostSampleIsInterpolatedAndSaid) {
  std::vector<double> times = even_times(1000);
  times.erase(times.begin() + 500);
  const TestFolder folder;
  const Dataset data = load({folder.write("lost.csv", csv_of(times, good_columns()))});
  EXPECT_EQ(of_kind(data.findings, "gap").size(), 1u);
  const Experiment& e = data.experiments[0];
  ASSERT_EQ(e.size(), 1000u);
  EXPECT_NEAR(e[Column::motor_position][500], position(0.5), 1e-4);
}

TEST(TimeBase, TimeThatStandsStillOrGoesBackIsAnErrorWithItsLine) {
  for (const double step : {0.0, -0.05}) {
    std::vector<double> times = even_times(200);
    for (std::size_t k = 120; k < 200; ++k) times[k] += step - 0.001;
    const TestFolder folder;
    const std::vector<Finding> errors = errors_of({folder.write("back.csv", csv_of(times, good_columns()))});
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(errors[0].kind, "time_not_increasing");
    EXPECT_EQ(errors[0].line, 122u);
    EXPECT_EQ(errors[0].column, "time_s");
  }
}

TEST(TimeBase, AHeldCommandIsHeldInResampling) {
  Experiment e;
  e.current_hold = CurrentHold::zoh;
  e.current_hold_stated = true;
  e.time_s = jittered_times(100, 0.1);
  e.masked.assign(100, 0);
  for (std::size_t k = 0; k < 100; ++k) e[Column::current].push_back(k < 50 ? 1.0 : 2.0);
  const TimeBase base = time_base(e.time_s);
  e.segments = base.segments;
  resample(e, base);
  for (const double amps : e[Column::current]) EXPECT_TRUE(amps == 1.0 || amps == 2.0) << amps;
}

// In degrees, of which the table of columns makes radians.
TEST(TimeBase, TheStepOfAnEncoderIsKnownAlsoWhereSamplesAreResampledAndInOtherUnits) {
  constexpr double kStep_deg = 360.0 / 65536.0;
  const auto encoder = [](double t) { return kStep_deg * std::floor(0.5 * std::sin(kOmega_rad_s * t) / kStep_deg); };
  const TestFolder folder;
  folder.write("uneven.csv", csv_of(jittered_times(2000, 0.1), {{"current_a", current}, {"angle", encoder}}));
  folder.write(
      "dataset.toml",
      "format = \"flexspline-dataset/1\"\n[columns]\nmotor_position_rad = { source = \"angle\", unit = \"deg\" }\n"
      "[[experiment]]\nfile = \"uneven.csv\"\n");
  const Dataset data = load({folder.path()});
  const double step = kStep_deg * std::numbers::pi / 180.0;
  EXPECT_NEAR(step_of(data.experiments[0], Column::motor_position).value(), step, 1e-3 * step);
}

TEST(TimeBase, SegmentsTooShortToFilterAreMaskedAndLeftOut) {
  std::vector<double> times = even_times(1000);
  for (std::size_t k = 400; k < 1000; ++k) times[k] += 0.3;
  for (std::size_t k = 405; k < 1000; ++k) times[k] += 0.3;
  const TestFolder folder;
  const Dataset data = load({folder.write("short.csv", csv_of(times, good_columns()))});
  const Experiment& e = data.experiments[0];
  ASSERT_EQ(e.segments.size(), 2u);
  EXPECT_EQ(e.segments[1].first, 405u);
  for (std::size_t k = 400; k < 405; ++k) EXPECT_EQ(e.masked[k], 1);
  EXPECT_EQ(of_kind(data.findings, "gap").size(), 2u);
}

}  // namespace
}  // namespace flexspline::data::data_time_base_test
