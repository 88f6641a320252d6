// When a motor encoder whose count rests counts as stuck, by the torque alone;
// on a drive: firmware_stuck_encoder_test.
#include "firmware/stuck_encoder_watch.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace flexspline::tests::firmware_stuck_encoder_watch_test {
namespace {

using firmware::N;

class Watched {
 public:
  Watched() {
    parameters_->safety.stuck_ticks = 80;
    parameters_->safety.stuck_torque = N::value(0.5);
    parameters_->safety.standstill = N::value(0.01);
    parameters_->loops.torque_limit = N::value(1.0);
  }
  bool tick(double torque, int moved = 0, double error = 0.0) {
    firmware::Estimate estimate;
    estimate.moved = moved;
    firmware::Output last;
    last.torque = N::value(torque);
    last.error = N::value(error);
    return watch.update(estimate, last, *parameters_);
  }
  // Ticks until the encoder is stuck, or -1.
  int ticks_until_stuck(double torque, int moved = 0, double error = 0.0) {
    for (int k = 1; k <= 2000; ++k)
      if (tick(torque, moved, error)) return k;
    return -1;
  }

  firmware::StuckEncoderWatch watch;

 private:
  std::unique_ptr<firmware::Parameters> parameters_ = std::make_unique<firmware::Parameters>();
};

TEST(StuckEncoderWatch, ATorqueThatChangesByMoreThanFrictionHoldsHasToMoveTheShaft) {
  Watched w;
  for (int k = 0; k < 50; ++k) EXPECT_FALSE(w.tick(0.0));
  // The smoothed torque has changed by half a base after 63 ticks.
  EXPECT_NEAR(w.ticks_until_stuck(0.8), 63 + 80, 3);
}

TEST(StuckEncoderWatch, ATorqueThatFrictionHoldsNeedNotMoveIt) {
  Watched w;
  for (int k = 0; k < 50; ++k) EXPECT_FALSE(w.tick(0.0));
  EXPECT_EQ(w.ticks_until_stuck(0.4), -1);
}

TEST(StuckEncoderWatch, AShaftThatTurnsIsNotStuckAndACountThatAlternatesByOneIsNoMotion) {
  Watched turns;
  for (int k = 0; k < 2000; ++k) EXPECT_FALSE(turns.tick(k % 400 < 200 ? 0.8 : -0.8, 3));
  Watched alternates;
  bool stuck = false;
  for (int k = 0; k < 400; ++k) stuck = alternates.tick(k < 50 ? 0.0 : 0.8, k % 2 == 0 ? 1 : -1) || stuck;
  EXPECT_TRUE(stuck);
}

TEST(StuckEncoderWatch, AtTheLimitOfTheTorqueADemandOfMotionHasToBeFollowed) {
  Watched holds;
  EXPECT_EQ(holds.ticks_until_stuck(1.0), -1) << "no motion is demanded";
  Watched stalls;
  EXPECT_EQ(stalls.ticks_until_stuck(1.0, 0, 0.1), 80 + 80 / 8 + 1);
}

TEST(StuckEncoderWatch, BeginsAnewWithEachArming) {
  Watched w;
  EXPECT_FALSE(w.watch.watches());
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(w.tick(0.0));
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(w.tick(0.8));
  w.watch.stop();
  EXPECT_FALSE(w.watch.watches());
  EXPECT_EQ(w.ticks_until_stuck(0.8), -1) << "the torque did not change since";
}

}  // namespace
}  // namespace flexspline::tests::firmware_stuck_encoder_watch_test
