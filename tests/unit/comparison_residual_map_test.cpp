// host/engine/comparison: residuals with a known cause on the rows of real motions.
#include "host/engine/comparison/residual_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::comparison::comparison_residual_map_test {
namespace {

using estimation::Balance;
using estimation::RegressionProblem;
using plant::Mode;
using plant::Waveform;

struct Rows {
  data::Dataset dataset;
  estimation::PreparedData prepared;
  std::unique_ptr<RegressionProblem> motor;
  Rows() {
    const plant::Drive drive = plant::demo_plant().drive;
    dataset = record(drive,
                     {plan("sine", Mode::velocity, Waveform::sine, 60.0, 1.0, 4.0),
                      plan("slow", Mode::velocity, Waveform::triangle, 12.0, 0.4, 5.0),
                      plan("locked", Mode::current, Waveform::sine, 2.0, 0.5, 4.0, true)},
                     1);
    estimation::PipelineOptions options;
    options.cutoff_hz = 30.0;
    prepared = estimation::prepare(pointers(dataset), known_model(drive), options);
    motor = std::make_unique<RegressionProblem>(prepared, Balance::motor);
  }
  template <class F>
  Eigen::VectorXd along(F value) const {
    Eigen::VectorXd rows(motor->rows());
    for (const auto& range : motor->records())
      for (Eigen::Index k = range.first; k < range.last; ++k)
        rows[k] = value(prepared.records[range.record].inputs[motor->sample_of(range, k)]);
    return rows;
  }
};

const Rows& rows() {
  static const Rows r;
  return r;
}

Eigen::VectorXd noise(Eigen::Index n, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd x(n);
  for (double& value : x) value = normal(generator);
  return x;
}

std::vector<Share> shares_of(const Eigen::VectorXd& residual) {
  return localise(*rows().motor, residual, estimation::autocorrelation_time(rows().motor->records(), residual));
}

double share_of(const std::vector<Share>& shares, const std::string& variable) {
  for (const Share& s : shares)
    if (s.variable == variable) return s.share_percent;
  return 0.0;
}

TEST(ResidualMap, FindsAlmostNothingInNoise) {
  // Some 60 maps at a level of 1e-3 (waves at 1e-3 together): 20 seeds give less than one find on average.
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) found += shares_of(noise(rows().motor->rows(), seed)).size();
  EXPECT_LE(found, 4u);
}

TEST(ResidualMap, NamesTheOrderOfARippleWithItsShareOfTheVariance) {
  // As strong as the noise: half of the variance. Slow enough to pass the filter everywhere is order 2.
  const Eigen::VectorXd r = noise(rows().motor->rows(), 1) + rows().along([](const auto& in) {
    const double hz = 2.0 * std::abs(in.velocity) / (2.0 * M_PI);
    return std::sqrt(2.0) * std::cos(2.0 * in.angle + 0.7) / (1.0 + std::pow(hz / 30.0, 10.0));
  });
  const auto shares = shares_of(r);
  const auto first = std::find_if(shares.begin(), shares.end(),
                                  [](const Share& s) { return s.variable.starts_with("motor_angle order"); });
  ASSERT_NE(first, shares.end());
  EXPECT_EQ(first->variable, "motor_angle order 2");
  // The locked record does not turn, and at speed the filter takes the ripple: less than half is left.
  EXPECT_GT(first->share_percent, 25.0);
  EXPECT_LT(first->share_percent, 55.0);
}

TEST(ResidualMap, ShowsWhatResistsMotionOverTheTorqueTimesDirection) {
  const Eigen::VectorXd r = 0.5 * noise(rows().motor->rows(), 2) + rows().along([](const auto& in) {
    return std::abs(in.torque) * (in.velocity > 0.0 ? 1.0 : -1.0);
  });
  const auto shares = shares_of(r);
  ASSERT_FALSE(shares.empty());
  EXPECT_GT(share_of(shares, "torque x direction"), 80.0);
  EXPECT_GT(share_of(shares, "torque x direction"), share_of(shares, "torque"));
}

TEST(ResidualMap, ShowsAFunctionOfVelocityOverIt) {
  const Eigen::VectorXd r =
      0.2 * noise(rows().motor->rows(), 3) + rows().along([](const auto& in) { return std::tanh(in.velocity / 20.0); });
  const auto shares = shares_of(r);
  EXPECT_GT(share_of(shares, "velocity"), 85.0);
  EXPECT_GT(share_of(shares, "velocity"), share_of(shares, "time"));
}

TEST(ResidualMap, SaysNothingOfAResidualOfAnotherLength) {
  EXPECT_TRUE(localise(*rows().motor, Eigen::VectorXd::Ones(3), 1.0).empty());
}

TEST(ResidualMap, BinsHoldEqualCountsAndEveryValue) {
  Eigen::VectorXd x(100);
  for (Eigen::Index k = 0; k < 100; ++k) x[k] = static_cast<double>((37 * k) % 100);
  x[5] = std::nan("");
  const Bins bins = equal_count_bins(x, 4);
  ASSERT_EQ(bins.count(), 4u);
  for (int b = 0; b < 4; ++b) {
    const auto count = std::count(bins.bin.begin(), bins.bin.end(), b);
    EXPECT_GE(count, 23);
    EXPECT_LE(count, 26);
  }
  EXPECT_EQ(bins.bin[5], -1);
  EXPECT_EQ(std::count(bins.bin.begin(), bins.bin.end(), -1), 1);
}

TEST(ResidualMap, AConstantHasNoBins) {
  EXPECT_EQ(equal_count_bins(Eigen::VectorXd::Ones(50), 4).count(), 0u);
}

TEST(ResidualMap, NoBinIsNarrowerThanItsVariableAllows) {
  Eigen::VectorXd x(1000);
  // Half of the samples at one temperature, as of a drive that is warm.
  for (Eigen::Index k = 0; k < 1000; ++k)
    x[k] = k < 500 ? 20.0 + 0.02 * static_cast<double>(k) : 30.0 + 1e-4 * static_cast<double>(k);
  const Bins bins = equal_count_bins(x, 24, 1.0);
  ASSERT_GE(bins.count(), 2u);
  for (std::size_t b = 0; b < bins.count(); ++b) EXPECT_GE(bins.edges[b + 1] - bins.edges[b], 1.0);
  EXPECT_EQ(bins.edges.back(), x.maxCoeff());
  EXPECT_EQ(std::count(bins.bin.begin(), bins.bin.end(), -1), 0);
  EXPECT_EQ(equal_count_bins(x, 24, 6.0).count(), 0u);
}

TEST(ResidualMap, MotorAngleStaysWithinATurn) {
  for (const SampleVariable& v : sample_variables(*rows().motor, data::Axis::rotary)) {
    if (v.name != "motor_angle") continue;
    EXPECT_GE(v.values.minCoeff(), 0.0);
    EXPECT_LE(v.values.maxCoeff(), 2.0 * M_PI);
    return;
  }
  FAIL() << "no motor_angle among the variables";
}

}  // namespace
}  // namespace flexspline::comparison::comparison_residual_map_test
