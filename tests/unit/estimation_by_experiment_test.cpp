// std/avg over experiments, each judged by its own error.
#include <gtest/gtest.h>

#include "host/engine/estimation/by_experiment.hpp"

namespace flexspline::estimation::estimation_by_experiment_test {
namespace {

AloneFit fit(std::string name, double value, double std) {
  AloneFit f;
  f.name = std::move(name);
  f.theta = Eigen::VectorXd::Constant(1, value);
  f.root_tolerance = Eigen::VectorXd::Constant(1, 0.5);
  f.covariance = Eigen::MatrixXd::Constant(1, 1, std * std);
  return f;
}

// The pooled value of such experiments is near zero, and by its size none of them would count.
TEST(ByExperiment, OneThatDisagreesInSignCounts) {
  const ByExperiment e = by_experiment({fit("a", 3.0, 0.1), fit("b", -2.9, 0.1), fit("c", 3.1, 0.1)}, {});
  EXPECT_EQ(e.counted(), 3u);
  EXPECT_GT(e.spread_percent.value(), 200.0);
  EXPECT_EQ(e.reliable, std::optional(false));
}

TEST(ByExperiment, OneThatIsNearZeroBesideLargerOnesCounts) {
  const ByExperiment e = by_experiment({fit("a", 3.0, 0.1), fit("b", 0.05, 0.1), fit("c", 3.1, 0.1)}, {});
  EXPECT_EQ(e.counted(), 3u);
}

TEST(ByExperiment, OneWithALargeErrorOfItsOwnIsLeftOutWithTheReason) {
  const ByExperiment e =
      by_experiment({fit("a", 3.0, 0.1), fit("b", 2.0, 1.0), fit("c", 3.1, 0.1), fit("d", 2.9, 0.1)}, {});
  EXPECT_EQ(e.counted(), 3u);
  EXPECT_EQ(e.left_out(), 1u);
  EXPECT_FALSE(e.per_experiment[1].value);
  EXPECT_NE(e.per_experiment[1].left_out.find("20 %"), std::string::npos);
  EXPECT_EQ(e.reliable, std::optional(true));
}

TEST(ByExperiment, ThatAllAreZeroWithinTheirErrorsIsNoVerdict) {
  const ByExperiment e = by_experiment({fit("a", 0.1, 0.5), fit("b", -0.1, 0.5), fit("c", 0.05, 0.5)}, {});
  EXPECT_EQ(e.counted(), 0u);
  EXPECT_FALSE(e.spread_percent);
  EXPECT_FALSE(e.reliable);
}

// T_vp = T_v + dT_v is determined where either alone is not: errors that are opposite cancel in the sum.
TEST(ByExperiment, ASumIsJudgedByItsOwnError) {
  AloneFit f = fit("a", 0.0, 0.0);
  f.theta = Eigen::Vector2d(2.0, 1.0);
  f.root_tolerance = Eigen::Vector2d(0.5, 0.5);
  f.covariance = (Eigen::Matrix2d() << 1.0, -0.999, -0.999, 1.0).finished();
  EXPECT_EQ(by_experiment({f}, {0, std::nullopt}).counted(), 0u);
  const ByExperiment sum = by_experiment({f}, {0, 1, 1.0});
  ASSERT_EQ(sum.counted(), 1u);
  EXPECT_DOUBLE_EQ(*sum.per_experiment[0].value, 3.0);
  EXPECT_EQ(by_experiment({f}, {0, 1, -1.0}).counted(), 0u) << "in the difference they add up";
}

}  // namespace
}  // namespace flexspline::estimation::estimation_by_experiment_test
