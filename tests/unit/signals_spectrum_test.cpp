#include "host/common/signals/spectrum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/common/signals/fft.hpp"

namespace flexspline::signals::signals_spectrum_test {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

std::vector<double> noise(std::size_t n, unsigned seed, double scale = 1.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, scale);
  std::vector<double> x(n);
  for (double& v : x) v = normal(random);
  return x;
}

double mean(const std::vector<double>& x, std::size_t first, std::size_t last) {
  double sum = 0.0;
  for (std::size_t i = first; i < last; ++i) sum += x[i];
  return sum / static_cast<double>(last - first);
}

// A repeating motion that no single sine describes: sweeps of unequal stroke, with rests, by fractions of the period.
double trajectory(double phase) {
  const auto stroke = [](double u) {
    return u <= 0.0 ? 0.0 : u >= 1.0 ? 1.0 : u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
  };
  return 2.0 * stroke(phase / 0.2) - 3.0 * stroke((phase - 0.3) / 0.25) + 1.4 * stroke((phase - 0.6) / 0.1) -
         0.4 * stroke((phase - 0.75) / 0.15);
}

std::vector<double> repeated(double period_samples, std::size_t n) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = trajectory(std::fmod(static_cast<double>(i) / period_samples, 1.0));
  return x;
}

TEST(Fft, AgreesWithTheDefinition) {
  for (const std::size_t size : {8u, 10u, 60u, 64u}) {
    const auto x = noise(size - 2, 1);
    const auto lines = RealFft(size).forward(x);
    ASSERT_EQ(lines.size(), size / 2 + 1);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      std::complex<double> sum;
      for (std::size_t i = 0; i < x.size(); ++i)
        sum += x[i] * std::polar(1.0, -kTwoPi * static_cast<double>(k * i % size) / static_cast<double>(size));
      EXPECT_LT(std::abs(lines[k] - sum), 1e-12) << "size " << size << ", line " << k;
    }
  }
}

TEST(Fft, InverseReturnsTheSignal) {
  for (const std::size_t size : {6u, 60u, 1000u}) {
    const auto x = noise(size, 2);
    RealFft fft(size);
    const auto back = fft.inverse(fft.forward(x));
    for (std::size_t i = 0; i < size; ++i) ASSERT_NEAR(back[i], x[i], 1e-13);
  }
}

TEST(Fft, RefusesWhatDoesNotFit) {
  EXPECT_THROW(RealFft(7), std::invalid_argument);
  EXPECT_THROW(RealFft(8).forward(std::vector<double>(9)), std::invalid_argument);
  EXPECT_THROW(RealFft(8).inverse(std::vector<std::complex<double>>(4)), std::invalid_argument);
  EXPECT_EQ(fast_fft_size(7), 8u);
  EXPECT_EQ(fast_fft_size(61), 64u);
  EXPECT_EQ(fast_fft_size(97), 100u);
}

TEST(Spectrum, DensityOfWhiteNoiseIsFlatAndSumsToTheVariance) {
  const double sample_hz = 500.0;
  const auto density = power_density(noise(200000, 3, 2.0), sample_hz, 256);
  ASSERT_EQ(density.size(), 129u);
  const double expected = 4.0 / (0.5 * sample_hz);
  EXPECT_NEAR(mean(density, 2, 64), expected, 0.03 * expected);
  EXPECT_NEAR(mean(density, 64, 127), expected, 0.03 * expected);
}

TEST(Spectrum, SineHoldsItsPowerAtItsLine) {
  const double sample_hz = 1000.0;
  std::vector<double> x(8192);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = 5.0 + 3.0 * std::sin(kTwoPi * 125.0 * static_cast<double>(i) / sample_hz);
  const auto density = power_density(x, sample_hz, 512);
  double sum = 0.0;
  for (const double d : density) sum += d * sample_hz / 512.0;
  EXPECT_NEAR(sum, 4.5, 1e-3);
  EXPECT_EQ(std::max_element(density.begin(), density.end()) - density.begin(), 64);
}

TEST(Spectrum, CrossOverAutoSpectrumIsTheFrequencyResponse) {
  const auto x = noise(100000, 4);
  std::vector<double> y(x.size(), 0.0);
  for (std::size_t i = 3; i < x.size(); ++i) y[i] = 2.0 * x[i - 3];
  const auto s = cross_spectrum(x, y, 1000.0, 512);
  for (std::size_t k = 5; k < 250; ++k) {
    const auto expected = std::polar(2.0, -kTwoPi * 3.0 * static_cast<double>(k) / 512.0);
    ASSERT_LT(std::abs(s.xy[k] / s.xx[k] - expected), 0.02) << k;
  }
  EXPECT_DOUBLE_EQ(s.frequency_hz[256], 500.0);
  EXPECT_EQ(s.averages, 389u);
}

TEST(Spectrum, CoherenceOfAKnownMixtureIsTheShareOfItsPower) {
  const auto x = noise(300000, 5), rest = noise(300000, 6);
  for (const double r : {0.0, 0.5, 1.0, 3.0}) {
    std::vector<double> y(x.size());
    for (std::size_t i = 0; i < y.size(); ++i) y[i] = x[i] + r * rest[i];
    const auto c = coherence(x, y, 1000.0, 256);
    EXPECT_NEAR(mean(c, 2, 127), 1.0 / (1.0 + r * r), 0.01) << r;
  }
}

TEST(Spectrum, UnrelatedSignalsExceedTheLimitAsOftenAsStated) {
  const auto s = cross_spectrum(noise(600000, 7), noise(600000, 8), 1000.0, 20000);
  const auto c = s.coherence();
  const double limit = coherence_limit(s.independent_averages(), 0.05);
  double above = 0.0;
  for (const double v : c) above += v > limit ? 1.0 : 0.0;
  EXPECT_NEAR(above / static_cast<double>(c.size()), 0.05, 0.01);
  EXPECT_EQ(coherence_limit(1.0), 1.0);
}

TEST(Spectrum, PooledRecordsWeighByTheirAverages) {
  const auto x = noise(40000, 9), y = noise(40000, 10);
  const auto a = cross_spectrum(x, y, 100.0, 64);
  const auto b = cross_spectrum(std::vector<double>(x.begin(), x.begin() + 640),
                                std::vector<double>(y.begin(), y.begin() + 640), 100.0, 64);
  const std::vector<CrossSpectrum> records{a, b};
  const auto both = pool(records);
  const double na = static_cast<double>(a.averages), nb = static_cast<double>(b.averages);
  EXPECT_EQ(both.averages, a.averages + b.averages);
  EXPECT_NEAR(both.xx[7], (na * a.xx[7] + nb * b.xx[7]) / (na + nb), 1e-15);
  EXPECT_NEAR(std::abs(both.xy[7] - (na * a.xy[7] + nb * b.xy[7]) / (na + nb)), 0.0, 1e-15);
  const std::vector<CrossSpectrum> odd{a, cross_spectrum(x, y, 100.0, 128)};
  EXPECT_THROW(pool(odd), std::invalid_argument);
  EXPECT_THROW(pool({}), std::invalid_argument);
}

TEST(Spectrum, ImpossibleSegmentsAreRefused) {
  const auto x = noise(100, 11), y = noise(99, 12);
  EXPECT_THROW(coherence(x, y, 1000.0, 32), std::invalid_argument);
  EXPECT_THROW(power_density(x, 1000.0, 128), std::invalid_argument);
  EXPECT_THROW(power_density(x, 1000.0, 33), std::invalid_argument);
  EXPECT_THROW(power_density(x, 0.0, 32), std::invalid_argument);
}

TEST(Repetition, OfAMadeUpTrajectoryIsFoundExactlyAndNotAMultiple) {
  for (const std::size_t n : {1474u, 2000u, 5000u, 9000u}) {
    const auto found = find_repetition(repeated(737.0, n));
    ASSERT_TRUE(found) << n;
    EXPECT_EQ(found->samples, 737u);
    EXPECT_EQ(found->exact_samples, 737.0);
    EXPECT_LT(found->mismatch, 1e-9);
  }
}

TEST(Repetition, IsFoundUnderNoiseAndOffset) {
  auto x = repeated(737.0, 4000);
  const auto n = noise(x.size(), 13, 0.008);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += n[i] + 250.0;
  const auto found = find_repetition(x);
  ASSERT_TRUE(found);
  EXPECT_NEAR(static_cast<double>(found->samples), 737.0, 1.0);
  // Both repetitions carry the noise; the trajectory's own RMS is near 0.9.
  EXPECT_GT(found->mismatch, 0.008);
  EXPECT_LT(found->mismatch, 0.02);
}

TEST(Repetition, BetweenSamplesIsRefined) {
  const auto found = find_repetition(repeated(737.4, 9000));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->samples, 737u);
  EXPECT_NEAR(found->exact_samples, 737.4, 0.05);
  EXPECT_NEAR(dominant_period_s(repeated(737.4, 4000), 1000.0).value(), 0.7374, 5e-5);
}

TEST(Repetition, OfAFastSineIsTheFirstThatFitsTheSamples) {
  std::vector<double> x(3000);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(kTwoPi * static_cast<double>(i) / 60.3);
  // 60 samples miss by 2 sin(pi 0.3 / 60.3) = 3 %, 181 samples (three periods) by 1 %.
  const auto found = find_repetition(x);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->samples, 181u);
  EXPECT_NEAR(found->exact_samples, 180.9, 0.01);
  EXPECT_NEAR(found->mismatch, 2.0 * std::sin(std::numbers::pi * 0.1 / 60.3), 2e-4);
}

TEST(Repetition, OfASineIsItsPeriod) {
  std::vector<double> x(3000);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(kTwoPi * static_cast<double>(i) / 125.0);
  EXPECT_EQ(find_repetition(x).value().samples, 125u);
}

TEST(Repetition, WeakRippleAtHalfTheRateDoublesThePeriod) {
  std::vector<double> x(4000);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double turn = kTwoPi * static_cast<double>(i) / 400.0;
    x[i] = std::sin(2.0 * turn) + 0.007 * std::sin(turn);
  }
  EXPECT_EQ(find_repetition(x).value().samples, 400u);
}

TEST(Repetition, NeedsTwoWholePeriods) {
  EXPECT_FALSE(find_repetition(repeated(737.0, 1473)));
  EXPECT_TRUE(find_repetition(repeated(737.0, 1474)));
}

TEST(Repetition, IsNotSeenInNoiseRampsRestAndDriftingAmplitude) {
  EXPECT_FALSE(find_repetition(noise(4000, 14)));
  EXPECT_FALSE(find_repetition(std::vector<double>(4000, 1.7)));
  EXPECT_FALSE(find_repetition({}));
  std::vector<double> ramp(4000), growing(4000);
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    const double t = static_cast<double>(i);
    ramp[i] = 0.01 * t;
    growing[i] = (1.0 + t / 4000.0) * std::sin(kTwoPi * t / 300.0);
  }
  EXPECT_FALSE(find_repetition(ramp));
  EXPECT_FALSE(find_repetition(growing));
}

TEST(Repetition, OfTheMeasuredDriveAxisIsThePublishedOne) {
  const char* folder = std::getenv("FLEXSPLINE_DATA");
  if (folder == nullptr) GTEST_SKIP() << "set FLEXSPLINE_DATA to the folder with the measured data sets";
  std::ifstream file(std::string(folder) + "/emps/emps_train.csv");
  ASSERT_TRUE(file) << "no emps/emps_train.csv in " << folder;
  std::string line, cell;
  std::getline(file, line);
  ASSERT_EQ(line.substr(0, 62), "time_s,motor_voltage_v,motor_force_n,position_m,position_ref_m");
  std::vector<double> position, reference;
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    for (int column = 0; std::getline(cells, cell, ','); ++column) {
      if (column == 3) position.push_back(std::stod(cell));
      if (column == 4) reference.push_back(std::stod(cell));
    }
  }
  ASSERT_EQ(position.size(), 24841u);
  const auto found = find_repetition(position);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->samples, 6240u);
  EXPECT_DOUBLE_EQ(dominant_period_s(position, 1000.0).value(), 6.24);
  EXPECT_EQ(find_repetition(reference).value().samples, 6240u);
}

}  // namespace
}  // namespace flexspline::signals::signals_spectrum_test
