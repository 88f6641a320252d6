// Blocks with drawn limits, by the ten thousand: whatever the drive's validator takes, every protection acts when its
// signal is driven beyond its limit, and random readings of an armed drive do no harm.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>

#include "tests/support/campaign_size.hpp"
#include "tests/support/closed_loop_runs.hpp"
#include "tests/support/limit_trial.hpp"

namespace flexspline::tests {
namespace {

TEST(DrawnLimits, ActWhereTheValidatorTakesThem) {
  const std::size_t seeds = testing::in_campaign(2'000, 180'000);
  std::atomic<int> accepted = 0;
  testing::on_all_cores(seeds, [&](std::size_t seed) {
    std::mt19937_64 random(seed);
    const auto setup = drawn_limits(random);
    const auto block = accepted_block(setup);
    if (!block) return;
    ++accepted;
    EXPECT_EQ(limits_that_do_not_act(*block, setup), "") << seed;
    arm_with_random_readings(*block, setup, random);
  });
  std::printf("%d of %zu drawn blocks were taken\n", accepted.load(), seeds);
  EXPECT_GT(accepted.load(), static_cast<int>(seeds) / 10);
}

}  // namespace
}  // namespace flexspline::tests
