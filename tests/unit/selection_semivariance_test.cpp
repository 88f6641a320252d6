// The variance of the noise from what neighbouring samples differ by.
#include <gtest/gtest.h>

#include <random>

#include "host/engine/selection/setting.hpp"

namespace flexspline::selection::selection_semivariance_test {
namespace {

TEST(Semivariance, IsTheVarianceOfWhiteNoiseAndNothingOfAConstant) {
  std::mt19937_64 chance(6);
  std::normal_distribution<double> normal;
  Setting setting;
  setting.cutoff_hz = 10.0;
  setting.runs = {{0, 0, 20000, 0.025}};
  const Eigen::VectorXd noise = Eigen::VectorXd::NullaryExpr(20000, [&] { return normal(chance); });
  EXPECT_NEAR(semivariance(setting, noise), 1.0, 0.03);
  EXPECT_EQ(semivariance(setting, Eigen::VectorXd::Constant(20000, 3.0)), 0.0);
}

}  // namespace
}  // namespace flexspline::selection::selection_semivariance_test
