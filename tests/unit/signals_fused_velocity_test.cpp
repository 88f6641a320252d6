// host/common/signals/fused_velocity: a velocity of two measurements.
#include "host/common/signals/fused_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/common/signals/differentiate.hpp"

namespace flexspline::signals::signals_fused_velocity_test {
namespace {

constexpr double kSample_s = 1e-3, kCutoff_hz = 100.0;
constexpr std::size_t kSamples = 6000;
constexpr double kPositionStd = 3e-3, kVelocityStd = 0.2;

struct Measured {
  std::vector<double> truth, position, derivative, velocity;  // filtered
};

// A motion with parts up to 40 Hz; `delay_s` and `gain` of the measured velocity.
Measured measured(double delay_s = 0.0, double gain = 1.0, double smoothed_hz = 0.0) {
  std::mt19937 chance(7);
  std::normal_distribution<double> normal;
  const auto speed = [](double t) {
    return 50.0 * std::sin(4.0 * t) + 5.0 * std::sin(60.0 * t) + 2.0 * std::sin(250.0 * t);
  };
  const auto angle = [](double t) {
    return -12.5 * std::cos(4.0 * t) - 5.0 / 60.0 * std::cos(60.0 * t) - 2.0 / 250.0 * std::cos(250.0 * t);
  };
  const ZeroPhaseFilter filter(5, kCutoff_hz, 1.0 / kSample_s);
  Measured m;
  std::vector<double> position, velocity;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double t = static_cast<double>(k) * kSample_s;
    m.truth.push_back(speed(t));
    position.push_back(angle(t) + kPositionStd * normal(chance));
    velocity.push_back(gain * speed(t - delay_s));
  }
  if (smoothed_hz > 0.0) velocity = ZeroPhaseFilter(2, smoothed_hz, 1.0 / kSample_s).apply(velocity);
  for (double& v : velocity) v += kVelocityStd * normal(chance);
  m.truth = filter.apply(m.truth);
  m.position = filter.apply(position);
  m.derivative = central_derivative(m.position, kSample_s);
  m.velocity = filter.apply(velocity);
  return m;
}

double error(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t k = 300; k + 300 < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size() - 600));
}

std::optional<FusedVelocity> fused(const Measured& m) {
  return fused_velocity(m.position, m.velocity, kPositionStd, kVelocityStd, kCutoff_hz, kSample_s);
}

TEST(FusedVelocity, IsBetterThanEitherAndSaysHowGoodItIs) {
  const Measured m = measured();
  const auto found = fused(m);
  ASSERT_TRUE(found);
  const double of_both = error(found->velocity, m.truth);
  EXPECT_LT(of_both, 0.5 * error(m.derivative, m.truth));
  EXPECT_LT(of_both, error(m.velocity, m.truth));
  EXPECT_NEAR(found->std, of_both, 0.15 * of_both);
  // Where 2 pi f * 3 mrad is 0.2 rad/s.
  EXPECT_NEAR(found->crossover_hz, 10.6, 0.1);
}

TEST(FusedVelocity, IsOnTheTimeAndTheScaleOfThePosition) {
  const Measured late = measured(1.0 * kSample_s, 1.03);
  const auto found = fused(late);
  ASSERT_TRUE(found);
  EXPECT_LT(error(found->velocity, late.truth), 0.6 * error(late.velocity, late.truth));
  EXPECT_LT(error(found->velocity, late.truth), 0.5 * error(late.derivative, late.truth));
}

TEST(FusedVelocity, TakesNoneThatIsLateOrOfAnotherSizeOrSmoothed) {
  EXPECT_FALSE(fused(measured(5.0 * kSample_s)));
  EXPECT_FALSE(fused(measured(0.0, 1.2)));
  EXPECT_FALSE(fused(measured(0.0, -1.0)));
  // The position shows what its drive has smoothed away.
  Measured smoothed = measured(0.0, 1.0, 5.0);
  EXPECT_FALSE(fused_velocity(smoothed.position, smoothed.velocity, 1e-4, 0.01, kCutoff_hz, kSample_s));
}

TEST(FusedVelocity, TakesNoneThatHasMoreNoiseThanTheDerivative) {
  const Measured m = measured();
  EXPECT_FALSE(fused_velocity(m.position, m.velocity, 1e-5, kVelocityStd, kCutoff_hz, kSample_s));
  EXPECT_FALSE(fused_velocity(m.position, m.velocity, 0.0, kVelocityStd, kCutoff_hz, kSample_s));
  const std::vector<double> few(20, 1.0), still(1000, 0.0);
  EXPECT_FALSE(fused_velocity(few, few, kPositionStd, kVelocityStd, kCutoff_hz, kSample_s));
  EXPECT_FALSE(fused_velocity(still, still, kPositionStd, kVelocityStd, kCutoff_hz, kSample_s));
}

}  // namespace
}  // namespace flexspline::signals::signals_fused_velocity_test
