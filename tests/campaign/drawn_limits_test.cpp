// Blocks with drawn limits, by the ten thousand: whatever the drive's validator takes, every protection acts when its
// signal is driven beyond its limit, and random readings of an armed drive do no harm. With sanitizers it is a program
// of its own, which `./dev soak MINUTES drawn-limits` runs over all seeds.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/campaign_size.hpp"
#include "tests/support/limit_trial.hpp"
#include "tests/support/on_all_cores.hpp"

namespace flexspline::tests::drawn_limits_test {
namespace {

std::size_t number_in(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::stoul(text);
}

TEST(DrawnLimits, ActWhereTheValidatorTakesThem) {
  const std::size_t first = number_in("FLEXSPLINE_FIRST_SEED", 0);
  const std::size_t seeds = number_in("FLEXSPLINE_SEEDS", tests::in_campaign(2'000, 180'000));
  std::atomic<int> accepted = 0;
  tests::on_all_cores(seeds, [&](std::size_t i) {
    const std::size_t seed = first + i;
    std::mt19937_64 random(seed);
    const auto setup = drawn_limits(random);
    const auto block = accepted_block(setup);
    if (!block) return;
    ++accepted;
    EXPECT_EQ(limits_that_do_not_act(*block, setup), "") << seed;
    EXPECT_TRUE(arm_with_random_readings(*block, setup, random)) << seed;
  });
  std::printf("%d of %zu drawn blocks were taken\n", accepted.load(), seeds);
  EXPECT_GT(accepted.load(), static_cast<int>(seeds) / 10);
}

}  // namespace
}  // namespace flexspline::tests::drawn_limits_test
