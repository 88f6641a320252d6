// Transforms, square root and readings against double.
#include "shared/control/foc/transforms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "hil/motor/motor.hpp"
#include "shared/control/foc/phase_currents.hpp"

namespace flexspline::control::foc::foc_transforms_test {
namespace {

constexpr double kCurrent = 0x1p-27;

TEST(FocTransforms, ClarkeAndParkAreThoseInDouble) {
  std::mt19937_64 random(3);
  double worst = 0.0, worst_back = 0.0;
  const auto current = [&] { return static_cast<std::int32_t>(static_cast<std::int64_t>(random() >> 35) - (1 << 28)); };
  for (int k = 0; k < 100'000; ++k) {
    const Phases x = {current(), current(), current()};
    const auto angle = static_cast<std::uint32_t>(random());
    const double rad = angle * 0x1p-32 * 2.0 * std::numbers::pi;
    const StatorVector v = clarke(x);
    const motor::Plane plane = motor::to_plane(motor::Triple{x.a * kCurrent, x.b * kCurrent, x.c * kCurrent});
    worst = std::max({worst, std::abs(v.alpha * kCurrent - plane.alpha), std::abs(v.beta * kCurrent - plane.beta)});
    const RotorVector r = park_quarter(v, rotation(angle));
    const motor::Axes axes = motor::to_axes(plane, rad);
    worst = std::max({worst, std::abs(4 * r.d * kCurrent - axes.d), std::abs(4 * r.q * kCurrent - axes.q)});
    const StatorVector back = inverse_park_quarter({4 * r.d, 4 * r.q}, rotation(angle));
    const Phases phases = inverse_clarke({4 * back.alpha, 4 * back.beta});
    const motor::Triple expected = motor::to_phases(plane);
    worst_back = std::max({worst_back, std::abs(phases.a * kCurrent - expected[0]),
                           std::abs(phases.b * kCurrent - expected[1]), std::abs(phases.c * kCurrent - expected[2])});
  }
  std::printf("Clarke and Park: %.1e of a base at most, there and back %.1e\n", worst, worst_back);
  EXPECT_LT(worst, 1e-7);
  EXPECT_LT(worst_back, 2e-7);
}

TEST(FocTransforms, SineAndCosineSideBySideHaveTheBitsOfTheSineAlone) {
  std::mt19937_64 random(9);
  for (int k = 0; k < 100'000; ++k) {
    const auto angle = k < 16 ? static_cast<std::uint32_t>(k) << 28 : static_cast<std::uint32_t>(random());
    const Rotation r = rotation(angle);
    ASSERT_EQ(r.sine, fixed::sine_word(angle) * 8) << angle;
    ASSERT_EQ(r.cosine, fixed::sine_word(angle + 0x40000000U) * 8) << angle;
  }
}

TEST(FocTransforms, ARotationByAStepIsThatOfTheSum) {
  std::mt19937_64 random(6);
  double worst = 0.0, worst_half = 0.0;
  for (int k = 0; k < 100'000; ++k) {
    const auto angle = static_cast<std::uint32_t>(random());
    const std::int32_t step = saturated_signed<28>(static_cast<std::int32_t>(random() >> 35) - (1 << 28));
    const Rotation by_step = rotated(rotation(angle), step), exact = rotation(angle + static_cast<std::uint32_t>(step));
    const double off = std::max(std::abs(by_step.cosine - exact.cosine), std::abs(by_step.sine - exact.sine)) * 0x1p-30;
    worst = std::max(worst, off);
    if (std::abs(step) < (1 << 27)) worst_half = std::max(worst_half, off);
  }
  std::printf("rotation by a step: %.1e at most, %.1e up to a thirty-second of a turn\n", worst, worst_half);
  EXPECT_LT(worst, 6e-6);
  EXPECT_LT(worst_half, 1.3e-7);
}

TEST(FocTransforms, TheSquareRootIsWithinItsErrorOverItsWholeDomain) {
  std::mt19937_64 random(4);
  double worst = 0.0;
  for (int k = 0; k < 200'000; ++k) {
    const auto x = static_cast<std::uint32_t>(random()) >> (random() & 31);
    const double exact = std::sqrt((x | 1) * 0x1p-32) * 0x1p31;
    const double off = std::abs(root_word(x) - exact);
    EXPECT_LE(off, 4e-5 * exact + 1.0) << x;
    if (x > 1000) worst = std::max(worst, off / exact);
  }
  EXPECT_LE(root_word(0), 0x1p31 * 1.6e-5);
  for (const std::uint32_t x : {1U, 3U, 0xFFFFFFFFU, 0x40000000U, 0x3FFFFFFFU})
    EXPECT_NEAR(root_word(x), std::sqrt(x * 0x1p-32) * 0x1p31, 4e-5 * 0x1p31 * std::sqrt(x * 0x1p-32) + 1.0) << x;
  std::printf("square root: %.1e of itself at most\n", worst);
}

TEST(FocPhaseCurrents, APhaseWithoutASampleIsWhatTheOthersLeave) {
  const SensorSettings s{{4096, 4096, 4096}, {}, false};
  const Phases reading = {1000, -300, -700};
  for (std::int32_t unmeasured = 0; unmeasured <= 3; ++unmeasured) {
    Phases damaged = reading;
    if (unmeasured == 1) damaged.a = 0;
    if (unmeasured == 2) damaged.b = 0;
    if (unmeasured == 3) damaged.c = 0;
    const Phases i = phase_currents(s, damaged, unmeasured);
    EXPECT_EQ(i.a, 1000 * 4096);
    EXPECT_EQ(i.b, -300 * 4096);
    EXPECT_EQ(i.c, -700 * 4096);
  }
  const SensorSettings two{{4096, 4096, 0}, {}, true};
  EXPECT_EQ(phase_currents(two, {1000, -300, 12345}, 0).c, -700 * 4096);
}

TEST(FocPhaseCurrents, CalibrationFindsOffsetsWithinTheNoiseOfTheirMean) {
  std::mt19937_64 random(5);
  const SensorSettings s{{4200, 4000, 4096}, {}, false};
  OffsetCalibration calibration;
  const double offset[3] = {120.3, -55.7, 8.25};
  while (!calibration.done()) {
    const auto noisy = [&](double x) {
      double sum = 0.0;
      for (int k = 0; k < 12; ++k) sum += std::ldexp(static_cast<double>(random() >> 11), -53) - 0.5;
      return static_cast<std::int32_t>(std::lround(x + 10.0 * sum));
    };
    calibration.add({noisy(offset[0]), noisy(offset[1]), noisy(offset[2])});
  }
  const auto r = calibration.result(s, {.offset = 400, .spread = 200});
  EXPECT_EQ(r.fault, OffsetFault::none);
  // Ten counts of noise over 1024 samples: four deviations of the mean are 1.3.
  EXPECT_NEAR(r.offset.a / 4200.0, offset[0], 1.3);
  EXPECT_NEAR(r.offset.b / 4000.0, offset[1], 1.3);
  EXPECT_NEAR(r.offset.c / 4096.0, offset[2], 1.3);
}

TEST(FocPhaseCurrents, CalibrationNamesThePhaseWhoseOffsetIsTooLargeOrWhoseCurrentFlows) {
  const SensorSettings s{{4096, 4096, 4096}, {}, false};
  OffsetCalibration off, flows;
  for (int k = 0; k < 1024; ++k) {
    off.add({0, 0, 500});
    flows.add({k % 5, static_cast<std::int32_t>(300.0 * std::sin(k * 0.05)), 0});
  }
  const OffsetCalibration::Limits limits{.offset = 400, .spread = 100};
  EXPECT_EQ(off.result(s, limits).fault, OffsetFault::offset_too_large);
  EXPECT_EQ(off.result(s, limits).phase, 3);
  EXPECT_EQ(flows.result(s, limits).fault, OffsetFault::current_flows);
  EXPECT_EQ(flows.result(s, limits).phase, 2);
}

}  // namespace
}  // namespace flexspline::control::foc::foc_transforms_test
