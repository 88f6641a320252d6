// The current loop on a winding whose exact response is known.
#include "shared/control/current_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexspline::control::control_current_loop_test {
namespace {

// 0.5 ohm, 0.25 mH, 24 V, full scale 5 A, 20 kHz, corner 1000 rad/s; gains by the header's equations.
constexpr double kResistance = 0.5, kInductance = 0.25e-3, kSupply = 24.0, kFull = 5.0, kTick = 50e-6, kCorner = 1000.0;
const CurrentLoopSetup kSetup{
    .proportional = static_cast<std::int32_t>(std::lround(256.0 * kCorner * kInductance * kFull / kSupply)),
    .integral = static_cast<std::int32_t>(std::lround(65536.0 * kCorner * kResistance * kFull / kSupply * kTick)),
    .limit = 30'000};

class Winding {
 public:
  // Between two ticks the voltage stands still: an exponential.
  void pass(std::int32_t share) {
    const double end = share / 32768.0 * kSupply / kResistance;
    current_ = end + (current_ - end) * std::exp(-kResistance / kInductance * kTick);
  }
  std::int32_t share() const { return static_cast<std::int32_t>(std::lround(current_ / kFull * 32768.0)); }

 private:
  double current_ = 0.0;
};

TEST(CurrentLoop, FollowsAStepAsItsCornerSays) {
  // The gains cancel the winding's pole: what is left is 1 - exp(-w t), a tick late.
  CurrentLoop loop;
  Winding winding;
  for (int tick = 1; tick <= 200; ++tick) {
    winding.pass(loop.update(kSetup, 16'384, winding.share()));
    const double expected = 16'384 * (1.0 - std::exp(-kCorner * kTick * tick));
    EXPECT_NEAR(winding.share(), expected, 0.06 * 16'384) << tick;
  }
  EXPECT_NEAR(winding.share(), 16'384, 40);
}

TEST(CurrentLoop, IsTheSameInBothDirections) {
  CurrentLoop up, down;
  Winding winding_up, winding_down;
  for (int tick = 0; tick < 100; ++tick) {
    winding_up.pass(up.update(kSetup, 20'000, winding_up.share()));
    winding_down.pass(down.update(kSetup, -20'000, winding_down.share()));
    EXPECT_NEAR(winding_up.share(), -winding_down.share(), 20);
  }
}

TEST(CurrentLoop, StaysWithinItsLimitAndDoesNotWindUp) {
  CurrentLoop loop;
  for (int tick = 0; tick < 100'000; ++tick) {
    const std::int32_t out = loop.update(kSetup, 32'767, -32'768);  // a winding that is open
    ASSERT_LE(out, kSetup.limit);
    ASSERT_GE(out, -kSetup.limit);
  }
  // Back at once when the error turns round: the integral holds no more than the limit.
  int ticks = 0;
  while (loop.update(kSetup, -32'768, 32'767) > 0 && ticks < 1000) ++ticks;
  EXPECT_LT(ticks, 200);
}

}  // namespace
}  // namespace flexspline::control::control_current_loop_test
