#include "host/common/signals/butterworth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/common/signals/differentiate.hpp"

namespace flexspline::signals::signals_butterworth_test {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

std::vector<double> sine(double frequency_hz, double sample_hz, std::size_t n, double phase = 0.0) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = std::sin(kTwoPi * frequency_hz * static_cast<double>(i) / sample_hz + phase);
  return x;
}

std::vector<double> noise(std::size_t n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  for (double& v : x) v = normal(random);
  return x;
}

// Magnitude of the Fourier transform of a response that is symmetric about its middle.
double response_at(const std::vector<double>& response, double frequency_hz, double sample_hz, double* imaginary) {
  const double middle = static_cast<double>(response.size() / 2);
  double re = 0.0, im = 0.0;
  for (std::size_t i = 0; i < response.size(); ++i) {
    const double angle = kTwoPi * frequency_hz / sample_hz * (static_cast<double>(i) - middle);
    re += response[i] * std::cos(angle);
    im -= response[i] * std::sin(angle);
  }
  *imaginary = im;
  return re;
}

TEST(Butterworth, EveryOrderHasTheClosedFormMagnitudeAndNoPhase) {
  constexpr double kSample = 1000.0;
  for (const double cutoff : {12.0, 90.0, 250.0, 430.0}) {
    for (int order = 1; order <= ZeroPhaseFilter::kMaxOrder; ++order) {
      const ZeroPhaseFilter filter(order, cutoff, kSample);
      std::vector<double> impulse(2 * filter.pad_length() + 401, 0.0);
      impulse[impulse.size() / 2] = 1.0;
      filter.apply_in_place(impulse);
      for (const double f : {0.0, 5.0, 12.0, 40.0, 90.0, 200.0, 250.0, 430.0, 480.0}) {
        const double r = std::tan(std::numbers::pi * f / kSample) / std::tan(std::numbers::pi * cutoff / kSample);
        const double expected = 1.0 / (1.0 + std::pow(r, 2 * order));
        double imaginary = 0.0;
        EXPECT_NEAR(response_at(impulse, f, kSample, &imaginary), expected, 1e-5)
            << "order " << order << ", cut-off " << cutoff << ", at " << f << " Hz";
        EXPECT_NEAR(imaginary, 0.0, 1e-5);
        EXPECT_NEAR(filter.gain(f), expected, 1e-12);
      }
    }
  }
}

TEST(Butterworth, BothPassesHalveASineAtTheCutoff) {
  const ZeroPhaseFilter filter(5, 20.0, 1000.0);
  const auto x = sine(20.0, 1000.0, 4000, 0.3);
  const auto y = filter.apply(x);
  for (std::size_t i = 1000; i < 3000; ++i) ASSERT_NEAR(y[i], 0.5 * x[i], 1e-6);
}

TEST(Butterworth, ZeroPhaseFilterKeepsASineInPlace) {
  const ZeroPhaseFilter filter(5, 50.0, 1000.0);
  const auto x = sine(5.0, 1000.0, 3000, 1.0);
  const auto y = filter.apply(x);
  for (std::size_t i = 500; i < 2500; ++i) ASSERT_NEAR(y[i], x[i], 1e-6);
}

TEST(Butterworth, ConstantPassesBitForBit) {
  for (const double cutoff : {0.01, 20.0, 499.0}) {
    const ZeroPhaseFilter filter(5, cutoff, 1000.0);
    for (const double value : {0.0, -3.7, 1e9}) {
      const std::vector<double> x(700, value);
      EXPECT_EQ(filter.apply(x), x);
    }
  }
}

TEST(Butterworth, StraightLinePassesToItsEnds) {
  const ZeroPhaseFilter filter(5, 20.0, 1000.0);
  std::vector<double> x(2000);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 4.0 + 0.01 * static_cast<double>(i);
  const auto y = filter.apply(x);
  // The delay of a pass is some 26 samples, so 0.26 in value; a millionth of it is left.
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(y[i], x[i], 1e-6) << i;
}

TEST(Butterworth, FilteringCommutesWithReversingTime) {
  const ZeroPhaseFilter filter(5, 30.0, 1000.0);
  const auto x = noise(3000, 1);
  const auto y = filter.apply(x);
  const auto z = filter.apply(std::vector<double>(x.rbegin(), x.rend()));
  const std::size_t edge = 2 * filter.settling_samples();
  for (std::size_t i = edge; i + edge < x.size(); ++i) ASSERT_NEAR(y[i], z[x.size() - 1 - i], 1e-5);
}

TEST(Butterworth, SettlingIsWhereTheResponseFallsBelowAThousandth) {
  const ZeroPhaseFilter filter(5, 20.0, 1000.0);
  std::vector<double> impulse(4001, 0.0);
  impulse[2000] = 1.0;
  const auto y = filter.apply(impulse);
  const std::size_t settling = filter.settling_samples();
  EXPECT_GE(std::abs(y[2000 + settling - 1]), 0.999e-3 * y[2000]);
  for (std::size_t d = settling; d < 1500; ++d) {
    ASSERT_LT(std::abs(y[2000 + d]), 1.001e-3 * y[2000]);
    ASSERT_LT(std::abs(y[2000 - d]), 1.001e-3 * y[2000]);
  }
}

TEST(Butterworth, SettlingOfASlowFilterGrowsAsThePeriodOfTheCutoff) {
  const double at_1_hz = static_cast<double>(ZeroPhaseFilter(5, 1.0, 1000.0).settling_samples());
  const double at_10_mhz = static_cast<double>(ZeroPhaseFilter(5, 0.01, 1000.0).settling_samples());
  EXPECT_NEAR(at_10_mhz / at_1_hz, 100.0, 1.0);
}

TEST(Butterworth, ColumnsGiveTheResultOfSingleSignals) {
  const ZeroPhaseFilter filter(5, 40.0, 1000.0);
  for (const int columns : {1, 2, 3, 4, 5, 7, 8}) {
    const auto values = noise(static_cast<std::size_t>(1500 * columns), 3);
    Eigen::MatrixXd x = Eigen::Map<const Eigen::MatrixXd>(values.data(), 1500, columns);
    const Eigen::MatrixXd y = filter.apply_columns(x);
    for (Eigen::Index c = 0; c < columns; ++c) {
      const auto single = filter.apply({values.data() + 1500 * c, 1500});
      for (Eigen::Index i = 0; i < 1500; ++i) ASSERT_NEAR(y(i, c), single[static_cast<std::size_t>(i)], 1e-13);
    }
  }
}

TEST(Butterworth, OnlyTheNamedBlockOfAMatrixIsFiltered) {
  const ZeroPhaseFilter filter(5, 40.0, 1000.0);
  const auto values = noise(900, 4);
  Eigen::MatrixXd x = Eigen::Map<const Eigen::MatrixXd>(values.data(), 300, 3);
  const Eigen::MatrixXd before = x;
  filter.apply_columns_in_place(x.block(50, 1, 200, 2));
  EXPECT_EQ(x.col(0), before.col(0));
  EXPECT_EQ(x.topRows(50), before.topRows(50));
  EXPECT_EQ(x.bottomRows(50), before.bottomRows(50));
  const auto single = filter.apply({values.data() + 350, 200});
  for (Eigen::Index i = 0; i < 200; ++i) ASSERT_NEAR(x(50 + i, 1), single[static_cast<std::size_t>(i)], 1e-13);
}

TEST(Butterworth, ShortSignalsPassWithoutHarm) {
  const ZeroPhaseFilter filter(5, 20.0, 1000.0);
  EXPECT_TRUE(filter.apply({}).empty());
  EXPECT_EQ(filter.apply(std::vector<double>{2.5}), std::vector<double>{2.5});
  for (const std::size_t n : {2u, 3u, 10u, 100u}) {
    std::vector<double> x(n, 1.0);
    x.back() = 2.0;
    for (const double v : filter.apply(x)) {
      EXPECT_GT(v, 0.0);
      EXPECT_LT(v, 3.0);
    }
  }
}

TEST(Butterworth, SignalAtRestLeavesNoDenormalDustThatSlowsTheLoop) {
  const ZeroPhaseFilter filter(5, 20.0, 1000.0);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(60000, 7);
  x.row(30000).setOnes();
  const Eigen::MatrixXd y = filter.apply_columns(x);
  for (const double v : y.reshaped()) ASSERT_TRUE(v == 0.0 || std::abs(v) > 1e-250) << v;
  EXPECT_EQ(y(59999, 0), 0.0);
}

TEST(Butterworth, ValueThatIsNotFiniteIsNotHidden) {
  auto x = noise(500, 5);
  x[200] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(ZeroPhaseFilter(5, 40.0, 1000.0).apply(x)[250]));
}

TEST(Butterworth, ImpossibleDesignsAreRefusedByName) {
  EXPECT_THROW(ZeroPhaseFilter(0, 10.0, 1000.0), std::invalid_argument);
  EXPECT_THROW(ZeroPhaseFilter(13, 10.0, 1000.0), std::invalid_argument);
  EXPECT_THROW(ZeroPhaseFilter(5, 0.0, 1000.0), std::invalid_argument);
  EXPECT_THROW(ZeroPhaseFilter(5, std::nan(""), 1000.0), std::invalid_argument);
  EXPECT_THROW(ZeroPhaseFilter(5, 10.0, 0.0), std::invalid_argument);
  try {
    ZeroPhaseFilter(5, 600.0, 1000.0);
    FAIL() << "a cut-off above half the sample rate was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("600"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("500"), std::string::npos);
  }
}

TEST(Differentiate, ParabolaIsExactIncludingTheEnds) {
  std::vector<double> x(50);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double t = 0.1 * static_cast<double>(i);
    x[i] = 1e3 + 2.0 * t - 3.0 * t * t;
  }
  const auto v = central_derivative(x, 0.1);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(v[i], 2.0 - 0.6 * static_cast<double>(i), 1e-10);
}

TEST(Differentiate, ErrorFallsWithTheSquareOfTheStep) {
  const auto worst = [](double step) {
    const auto n = static_cast<std::size_t>(std::lround(3.0 / step)) + 1;
    std::vector<double> x(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = std::exp(static_cast<double>(i) * step);
    const auto v = central_derivative(x, step);
    double error = 0.0;
    for (std::size_t i = 0; i < n; ++i) error = std::max(error, std::abs(v[i] - x[i]));
    return error;
  };
  EXPECT_NEAR(worst(0.02) / worst(0.01), 4.0, 0.15);
}

TEST(Differentiate, FewSamplesAndBadStepsAreHandled) {
  EXPECT_TRUE(central_derivative({}, 1.0).empty());
  EXPECT_EQ(central_derivative(std::vector<double>{3.0}, 1.0), std::vector<double>{0.0});
  EXPECT_EQ(central_derivative(std::vector<double>{3.0, 4.0}, 0.5), (std::vector<double>{2.0, 2.0}));
  EXPECT_THROW(central_derivative(std::vector<double>{3.0, 4.0}, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::signals::signals_butterworth_test
