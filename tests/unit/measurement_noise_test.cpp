// Periods and noise of excitations made to measure.
#include <gtest/gtest.h>

#include <cmath>

#include "host/engine/measurement/measure.hpp"
#include "host/engine/measurement/noise.hpp"
#include "host/engine/measurement/period.hpp"
#include "tests/unit/measurement_signals.hpp"

namespace flexspline::measurement::measurement_noise_test {
namespace {

using data::Column;

constexpr double kSample = 1e-3;

data::Experiment multisine_record(double period_s, std::size_t samples, double noise) {
  data::Experiment e = tests::experiment_of(samples, kSample);
  const auto lines = tests::multisine(41, 0.2, 3);
  e[Column::current_command] = tests::signal_of(lines, period_s, kSample, samples);
  e[Column::current] = e[Column::current_command];
  tests::add_noise(e[Column::current], noise, 4);
  return e;
}

TEST(Period, IsFoundInTheSetPointAndWithoutIt) {
  data::Experiment e = multisine_record(1.501, 9000, 0.02);
  PeriodSearch search = find_period(e);
  ASSERT_TRUE(search.period.has_value()) << search.why_not;
  EXPECT_EQ(search.period->samples, 1501u);
  EXPECT_TRUE(search.period->is_whole());
  EXPECT_EQ(search.period->from, "current_command_a");
  EXPECT_EQ(search.period->count, 4u);
  e[Column::current_command].clear();
  search = find_period(e);
  ASSERT_TRUE(search.period.has_value()) << search.why_not;
  EXPECT_NEAR(search.period->exact_samples, 1501.0, 0.05);
  EXPECT_EQ(search.period->from, "current_a");
}

TEST(Period, IsNotFoundInNoiseAndThenSaysWhy) {
  data::Experiment e = tests::experiment_of(4000, kSample);
  e[Column::current].assign(4000, 0.0);
  tests::add_noise(e[Column::current], 1.0, 1);
  const PeriodSearch search = find_period(e);
  EXPECT_FALSE(search.period.has_value());
  EXPECT_FALSE(search.why_not.empty());
  const PeriodSearch long_one = find_period(e, 3.0);
  EXPECT_FALSE(long_one.period.has_value());
  EXPECT_NE(long_one.why_not.find("two whole ones"), std::string::npos) << long_one.why_not;
}

TEST(Period, InWhichTheMotionSettlesIsLeftOut) {
  data::Experiment e = multisine_record(1.5, 15000, 0.0);
  e[Column::motor_velocity] = e[Column::current];
  EXPECT_EQ(find_period(e).period->left_out, 1u);
  // Still above the noise in the third of the ten periods.
  for (std::size_t k = 0; k < e.size(); ++k) e[Column::motor_velocity][k] += 50.0 * std::exp(-e.time_s[k] / 0.8);
  tests::add_noise(e[Column::motor_velocity], 0.02, 6);
  const PeriodSearch search = find_period(e);
  EXPECT_GE(search.period->left_out, 2u);
  EXPECT_GE(search.period->count, 3u);
  EXPECT_EQ(search.period->left_out + search.period->count, 10u);
  const NoiseLevel level = noise_by_periods(tests::channel(e[Column::motor_velocity]), *search.period, kSample);
  EXPECT_NEAR(level.rms, 0.02, 0.002);
}

TEST(Period, OfAnyLengthHasTheLinesOfItsCosines) {
  // Quick, odd, prime, and twice a prime.
  for (const std::size_t n : {1500u, 1501u, 10007u, 20014u}) {
    const auto lines = tests::multisine(99, 0.7, 8);
    const auto found = line_amplitudes(tests::signal_of(lines, static_cast<double>(n) * kSample, kSample, n));
    ASSERT_EQ(found.size(), n / 2 + 1);
    std::vector<std::complex<double>> truth(found.size());
    for (const tests::Line& line : lines) truth[line.line] = line.amplitude;
    for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(std::abs(found[k] - truth[k]), 0.0, 1e-9) << k;
  }
}

TEST(Period, ExcitedLinesAreThoseOfTheExcitation) {
  const data::Experiment e = multisine_record(1.5, 9000, 0.02);
  data::Experiment blind = e;
  blind[Column::current_command].clear();
  for (const data::Experiment& record : {e, blind}) {
    const ExcitedLines excited = excited_lines(record, *find_period(record).period);
    std::vector<std::size_t> truth;
    for (const tests::Line& line : tests::multisine(41, 0.2, 3)) truth.push_back(line.line);
    EXPECT_EQ(excited.lines, truth);
  }
  EXPECT_FALSE(excited_lines(blind, *find_period(blind).period).by_set_point);
}

TEST(NoiseFloor, IsWhatWasAddedWithinTenPercent) {
  const double noise = 0.02;
  // The second period falls between samples and is cut by interpolation.
  for (const double period_s : {1.5, 1.5004}) {
    const data::Experiment e = multisine_record(period_s, 9100, noise);
    const PeriodSearch search = find_period(e);
    ASSERT_TRUE(search.period.has_value());
    EXPECT_EQ(search.period->is_whole(), period_s == 1.5);
    const NoiseLevel level =
        noise_by_periods(tests::channel(e[Column::current], "current_a", "A"), *search.period, kSample);
    EXPECT_NEAR(level.rms, noise, 0.1 * noise) << period_s;
    EXPECT_NEAR(level.signal_rms, std::sqrt(17.0 / 2.0) * 0.2, 0.1) << period_s;
  }
}

TEST(NoiseFloor, HasTheSpectrumOfWhiteNoiseAndAddsUpToItsPower) {
  const double noise = 0.02;
  const data::Experiment e = multisine_record(2.0, 40020, noise);
  const NoiseLevel level = noise_by_periods(tests::channel(e[Column::current]), *find_period(e).period, kSample);
  const double density = noise * noise * 2.0 * kSample;
  double power = 0.0;
  for (const NoiseBand& band : level.bands) {
    power += band.density * (band.high_hz - band.low_hz);
    if (band.high_hz - band.low_hz > 10.0) {
      EXPECT_NEAR(band.density, density, 0.15 * density) << band.low_hz;
    }
  }
  EXPECT_NEAR(std::sqrt(power), level.rms, 0.02 * level.rms);
}

TEST(NoiseFloor, DoesNotHoldADriftAndNotWhatRepeats) {
  const double noise = 0.01;
  const std::size_t n = 12020;
  data::Experiment e = multisine_record(1.5, n, noise);
  std::vector<double> signal(n, 0.0);
  tests::add_noise(signal, noise, 21);
  for (std::size_t k = 0; k < n; ++k) {
    signal[k] += 3.0 * e.time_s[k] + (k % 1500 < 750 ? 1.0 : -1.0);  // a drifting axis with dry friction
  }
  const NoiseLevel level = noise_by_periods(tests::channel(signal), *find_period(e).period, kSample);
  EXPECT_NEAR(level.rms, noise, 0.1 * noise);
  EXPECT_GT(level.signal_rms, 1.0);
}

TEST(NoiseFloor, OfARecordAtRestIsThatOfItsSensors) {
  data::Experiment e = tests::experiment_of(20000, kSample);
  e[Column::current].assign(20000, 0.1);
  tests::add_noise(e[Column::current], 0.02, 2);
  e[Column::motor_position].assign(20000, 1.0);
  ASSERT_TRUE(is_at_rest(e));
  data::Dataset dataset;
  dataset.experiments.push_back(std::move(e));
  const Measurement m = measure(dataset);
  ASSERT_EQ(m.records[0].noise.size(), 3u);  // current, position, velocity
  EXPECT_EQ(m.records[0].noise[0].from, "standstill");
  EXPECT_NEAR(m.records[0].noise[0].rms, 0.02, 0.002);
  EXPECT_EQ(m.records[0].noise[1].rms, 0.0);
  EXPECT_TRUE(m.records[0].responses.empty());
}

TEST(Measurement, SaysWhatItCannotTellAndWhatToRecord) {
  // A ramp of the velocity under a growing current: neither periodic nor rich.
  data::Dataset dataset;
  dataset.experiments.push_back(tests::experiment_of(5000, kSample));
  data::Experiment& e = dataset.experiments[0];
  for (const double t : e.time_s) {
    e[Column::current].push_back(0.1 + 0.05 * t);
    e[Column::motor_position].push_back(2.0 * t * t);
  }
  const Measurement m = measure(dataset);
  EXPECT_FALSE(m.records[0].period.has_value());
  EXPECT_FALSE(m.records[0].no_noise.empty());
  ASSERT_EQ(m.notes.size(), 2u);
  EXPECT_EQ(m.records[0].responses.at(0).trusted(), 0u);
  EXPECT_NE(m.notes[0].find("resonance"), std::string::npos);
  EXPECT_NE(m.notes[0].find("multisine"), std::string::npos);
  EXPECT_NE(m.notes[0].find("distortion"), std::string::npos);
  EXPECT_NE(m.notes[1].find("noise floor"), std::string::npos);
}

TEST(Measurement, WithoutAnEffortSaysWhichColumnIsMissing) {
  data::Dataset dataset;
  dataset.experiments.push_back(tests::experiment_of(5000, kSample));
  data::Experiment& e = dataset.experiments[0];
  for (const double t : e.time_s) e[Column::motor_position].push_back(std::sin(t));
  const Measurement m = measure(dataset);
  ASSERT_FALSE(m.notes.empty());
  EXPECT_NE(m.notes[0].find("current_a"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::measurement::measurement_noise_test
