// Odd and even distortion of static nonlinearities, whose spectra are convolutions of the excitation's lines.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "host/engine/measurement/distortion.hpp"
#include "tests/unit/measurement_signals.hpp"

namespace flexspline::measurement::measurement_distortion_test {
namespace {

using data::Column;
using tests::Line;

constexpr double kSample = 1e-3;
constexpr double kPeriod = 1.0;
constexpr std::size_t kHighest = 61;

// Coefficients of exp(2 pi j k t / period), of both signs of k.
using TwoSided = std::map<long, std::complex<double>>;

TwoSided two_sided(const std::vector<Line>& lines) {
  TwoSided c;
  for (const Line& line : lines) {
    c[static_cast<long>(line.line)] = 0.5 * line.amplitude;
    c[-static_cast<long>(line.line)] = 0.5 * std::conj(line.amplitude);
  }
  return c;
}

// Spectrum of the product of two signals.
TwoSided product(const TwoSided& a, const TwoSided& b) {
  TwoSided c;
  for (const auto& [ka, va] : a)
    for (const auto& [kb, vb] : b) c[ka + kb] += va * vb;
  return c;
}

struct Truth {
  double odd_db, even_db;
};

// x + quadratic x^2 + cubic x^3: mean power of a left-out odd and of an even line within the band over an excited one.
Truth truth_of(const std::vector<Line>& lines, double quadratic, double cubic) {
  const TwoSided x = two_sided(lines), square = product(x, x), cube = product(square, x);
  double excited = 0.0, odd = 0.0, even = 0.0, excited_lines = 0.0, odd_lines = 0.0, even_lines = 0.0;
  const auto at = [](const TwoSided& c, long k) {
    const auto found = c.find(k);
    return found == c.end() ? std::complex<double>() : found->second;
  };
  for (long k = static_cast<long>(lines.front().line); k <= static_cast<long>(lines.back().line); ++k) {
    const double power = std::norm(at(x, k) + quadratic * at(square, k) + cubic * at(cube, k));
    const bool is_excited = x.contains(k);
    (is_excited ? excited : k % 2 == 1 ? odd : even) += power;
    (is_excited ? excited_lines : k % 2 == 1 ? odd_lines : even_lines) += 1.0;
  }
  const auto level = [&](double power, double count) {
    return 10.0 * std::log10(power / count / (excited / excited_lines));
  };
  return {level(odd, odd_lines), level(even, even_lines)};
}

Distortion distortion_in(const std::vector<Line>& lines, double quadratic, double cubic, double noise) {
  const std::size_t n = 6 * 1000 + 20;
  data::Experiment e = tests::experiment_of(n, kSample);
  e[Column::current] = tests::signal_of(lines, kPeriod, kSample, n);
  std::vector<double> y;
  for (const double x : e[Column::current]) y.push_back(x + quadratic * x * x + cubic * x * x * x);
  if (noise > 0.0) tests::add_noise(y, noise, 9);
  const Period period = *find_period(e).period;
  return distortion_of(tests::channel(e[Column::current]), tests::channel(y, "y"), period, kSample,
                       excited_lines(e, period));
}

TEST(Distortion, OfACubeIsOddAtThePredictedLevel) {
  const auto lines = tests::multisine(kHighest, 0.1, 5);
  const double cubic = 0.3;
  const Truth truth = truth_of(lines, 0.0, cubic);
  const Distortion d = distortion_in(lines, 0.0, cubic, 1e-4);
  EXPECT_EQ(d.excitation, Excitation::kOddMultisine);
  EXPECT_EQ(d.excited_lines, lines.size());
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_TRUE(d.odd->significant);
  EXPECT_NEAR(d.odd->level_db, truth.odd_db, 0.3);
  EXPECT_LT(truth.odd_db, -15.0);  // the example is neither trivial nor hidden
  EXPECT_GT(truth.odd_db, -40.0);
  EXPECT_FALSE(d.even->significant);
  EXPECT_LT(d.even->level_db, d.odd->level_db - 20.0);
}

TEST(Distortion, OfASquareIsEvenAtThePredictedLevel) {
  const auto lines = tests::multisine(kHighest, 0.1, 6);
  const double quadratic = 0.1;
  const Truth truth = truth_of(lines, quadratic, 0.0);
  const Distortion d = distortion_in(lines, quadratic, 0.0, 1e-4);
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_TRUE(d.even->significant);
  EXPECT_NEAR(d.even->level_db, truth.even_db, 0.3);
  EXPECT_FALSE(d.odd->significant);
  EXPECT_LT(d.odd->level_db, d.even->level_db - 20.0);
}

TEST(Distortion, OfBothIsDistinguished) {
  const auto lines = tests::multisine(kHighest, 0.1, 7);
  const Truth truth = truth_of(lines, 0.02, 0.3);
  const Distortion d = distortion_in(lines, 0.02, 0.3, 1e-4);
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_NEAR(d.odd->level_db, truth.odd_db, 0.3);
  EXPECT_NEAR(d.even->level_db, truth.even_db, 0.3);
}

TEST(Distortion, OfALinearDriveIsNotSignificantAndItsNoiseIsKnown) {
  const auto lines = tests::multisine(kHighest, 0.1, 8);
  const double noise = 0.02;
  const Distortion d = distortion_in(lines, 0.0, 0.0, noise);
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_FALSE(d.odd->significant);
  EXPECT_FALSE(d.even->significant);
  // A line of one period holds 4 sigma^2 / n, the mean of five periods a fifth of it.
  const double truth = 10.0 * std::log10(4.0 * noise * noise / 1000.0 / 5.0 / (0.1 * 0.1));
  EXPECT_NEAR(d.even->noise_db, truth, 1.0);
  EXPECT_NEAR(d.odd->noise_db, truth, 2.5);
}

TEST(Distortion, ThatAControllerPutsIntoTheCurrentIsThatOfThePlant) {
  // y = x + 0.3 y^3 with y kept to the multisine: all of the distortion is in the input.
  const auto lines = tests::multisine(kHighest, 0.1, 5);
  const std::size_t n = 6020;
  data::Experiment e = tests::experiment_of(n, kSample);
  e[Column::velocity_command] = tests::signal_of(lines, kPeriod, kSample, n);
  for (const double y : e[Column::velocity_command]) e[Column::current].push_back(y - 0.3 * y * y * y);
  const Period period = *find_period(e).period;
  EXPECT_EQ(period.from, "velocity_command_rad_s");
  const Distortion d = distortion_of(tests::channel(e[Column::current]), tests::channel(e[Column::velocity_command]),
                                     period, kSample, excited_lines(e, period));
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_TRUE(d.odd->significant);
  EXPECT_NEAR(d.odd->level_db, truth_of(lines, 0.0, -0.3).odd_db, 2.0);
  EXPECT_FALSE(d.even->significant);
}

TEST(Distortion, OfASineIsThatOfItsHarmonics) {
  // A sine of unit amplitude: x^3 has a quarter of its amplitude at the third harmonic and three quarters at the first,
  // x^2 a half at the second.
  const std::vector<Line> lines = {{1, 1.0}};
  const Distortion d = distortion_in(lines, 0.01, 0.1, 0.0);
  EXPECT_EQ(d.excitation, Excitation::kSine);
  ASSERT_TRUE(d.odd && d.even);
  EXPECT_NEAR(d.odd->level_db, 20.0 * std::log10(0.025 / 1.075), 0.01);
  EXPECT_NEAR(d.even->level_db, 20.0 * std::log10(0.005 / 1.075), 0.01);
  EXPECT_NEAR(d.odd->rms, 0.025 / std::sqrt(2.0), 1e-6);
}

TEST(Distortion, CannotBeDistinguishedWhereEvenLinesAreExcited) {
  const Distortion d = distortion_in(tests::multisine(kHighest, 0.1, 5, false), 0.1, 0.1, 1e-4);
  EXPECT_EQ(d.excitation, Excitation::kOther);
  EXPECT_FALSE(d.odd || d.even);
  EXPECT_NE(d.odd_why_not.find("even lines"), std::string::npos);
}

TEST(Distortion, WithoutLeftOutLinesReportsTheEvenOneAlone) {
  const Distortion d = distortion_in(tests::multisine(kHighest, 0.1, 5, true, false), 0.1, 0.1, 1e-4);
  EXPECT_FALSE(d.odd.has_value());
  EXPECT_NE(d.odd_why_not.find("left out"), std::string::npos);
  ASSERT_TRUE(d.even.has_value());
  EXPECT_TRUE(d.even->significant);
}

}  // namespace
}  // namespace flexspline::measurement::measurement_distortion_test
