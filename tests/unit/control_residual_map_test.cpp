// The map of the residual on the drive: its bins against sums kept in double, what it forgets, and its size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "host/common/numbers/real.hpp"
#include "shared/control/residual_map.hpp"
#include "shared/fixed/overflow_log.hpp"

namespace flexspline::tests::control_residual_map_test {
namespace {

using control::ResidualMap;
using fixed::OverflowLog;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.velocity_base = 200.0;
  d.torque_base = 0.5;
  return d;
}
ResidualMap::Coefficients made(double largest_residual = 0.1) {
  return ResidualMap::derive<numbers::Real>(
      control::ResidualMapSetup<double>{
          .standstill_velocity = 0.2, .largest_velocity = 200.0, .largest_residual = largest_residual},
      drive());
}
fixed::Value value(double x) {
  return fixed::make_value(x);
}
fixed::Angle turns(double x) {
  return {std::llround(std::ldexp(x, 32))};
}

TEST(ResidualMap, TakesLessThanFourKilobytes) {
  EXPECT_LE(sizeof(ResidualMap), 4096u);
  EXPECT_EQ(ResidualMap::kVelocityBins * ResidualMap::kAngleBins, 480u);
}

TEST(ResidualMap, VelocityBinsAreGeometricSignedAndHaveStandstillInTheMiddle) {
  const auto c = made();
  const auto bin = [&](double rad_s) { return ResidualMap::velocity_bin(c, value(rad_s / 200.0)); };
  EXPECT_EQ(bin(0.0), 7u);
  EXPECT_EQ(bin(0.19), 7u);
  EXPECT_EQ(bin(-0.19), 7u);
  double edge = 0.2;
  for (std::size_t i = 0; i < 7; ++i, edge *= std::pow(1000.0, 1.0 / 6.0)) {
    EXPECT_EQ(bin(edge * 1.0001), 8 + i);
    EXPECT_EQ(bin(edge * 0.9999), 7 + i);
    EXPECT_EQ(bin(-edge * 1.0001), 6 - i);
    EXPECT_EQ(bin(-edge * 0.9999), 7 - i);
  }
  EXPECT_EQ(bin(800.0), 14u);
  EXPECT_EQ(ResidualMap::velocity_bin(c, {INT32_MIN}), 0u);
}

TEST(ResidualMap, AngleBinsDivideATurnAndRepeat) {
  for (int k = -70; k < 70; ++k) {
    const double middle = (k + 0.5) / 32.0;
    EXPECT_EQ(ResidualMap::angle_bin(turns(middle)), static_cast<std::size_t>(((k % 32) + 32) % 32));
    EXPECT_EQ(ResidualMap::angle_bin(turns(middle + 1000.0)), ResidualMap::angle_bin(turns(middle)));
  }
}

struct Sums {
  double count = 0.0, sum = 0.0, squares = 0.0;
};

TEST(ResidualMap, BinsHoldCountSumAndSquaresAsDoubleDoes) {
  const auto c = made();
  ResidualMap map;
  std::map<std::pair<std::size_t, std::size_t>, Sums> expected;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int k = 0; k < 200'000; ++k) {
    const double v = std::pow(uniform(random), 3), at = 50.0 * uniform(random), residual_nm = 0.12 * uniform(random);
    map.add(c, value(v), turns(at), value(residual_nm / 0.5));
    const double rad_s = std::abs(v) * 200.0;
    const int above =
        rad_s < 0.2 ? 0 : 1 + std::min(6, static_cast<int>(std::log(rad_s / 0.2) / std::log(1000.0) * 6.0));
    const auto bin_v = static_cast<std::size_t>(v < 0.0 ? 7 - above : 7 + above);
    const auto bin_a = static_cast<std::size_t>((at - std::floor(at)) * 32.0);
    Sums& s = expected[{bin_v, bin_a}];
    const double units = std::clamp(std::round(residual_nm / 0.1 * 511.0), -511.0, 511.0);
    s.count += 1.0;
    s.sum += units;
    s.squares += units * units;
  }
  double most = 0.0;
  int filled = 0, off = 0;
  for (std::size_t v = 0; v < ResidualMap::kVelocityBins; ++v) {
    for (std::size_t a = 0; a < ResidualMap::kAngleBins; ++a) {
      ResidualMap::Bin bin;
      ASSERT_TRUE(map.read(v, a, bin));
      const Sums& s = expected[{v, a}];
      most = std::max(most, s.count);
      ASSERT_LT(s.count, 4094.0);
      // A sample on an edge, or on half a unit, may fall to either side.
      if (bin.count != s.count || bin.sum != s.sum || bin.squares != s.squares) ++off;
      EXPECT_NEAR(bin.count, s.count, 1.0);
      EXPECT_NEAR(bin.sum, s.sum, 512.0);
      filled += bin.count > 0 ? 1 : 0;
    }
  }
  EXPECT_LE(off, 4);
  EXPECT_GT(filled, 400);
  EXPECT_GT(most, 500.0);
}

TEST(ResidualMap, AFullBinKeepsItsMeanAndVarianceAndForgetsWhatIsOld) {
  const auto c = made();
  ResidualMap map;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.02, 0.01);
  const auto feed = [&](int samples, double sign) {
    for (int k = 0; k < samples; ++k) map.add(c, value(0.5), turns(0.01), value(sign * normal(random) / 0.5));
  };
  feed(100'000, 1.0);
  ResidualMap::Bin bin;
  ASSERT_TRUE(map.read(ResidualMap::velocity_bin(c, value(0.5)), 0, bin));
  const double unit = 0.1 / 511.0;
  EXPECT_GE(bin.count, 2047u);
  EXPECT_LE(bin.count, 4094u);
  const double mean = bin.sum * unit / bin.count;
  EXPECT_NEAR(mean, 0.02, 0.001);
  EXPECT_NEAR(std::sqrt(bin.squares * unit * unit / bin.count - mean * mean), 0.01, 0.0005);
  feed(20'000, -1.0);
  ASSERT_TRUE(map.read(ResidualMap::velocity_bin(c, value(0.5)), 0, bin));
  EXPECT_NEAR(bin.sum * unit / bin.count, -0.02, 0.001);
}

TEST(ResidualMap, TheWorstResidualsNeverOverflowABin) {
  const auto c = made();
  for (const std::int32_t worst : {INT32_MAX, INT32_MIN}) {
    ResidualMap map;
    for (int k = 0; k < 100'000; ++k) {
      map.add(c, {INT32_MAX}, {INT64_MIN}, {worst});
      if (k % 977 != 0 && k != 4093 && k != 4094) continue;
      ResidualMap::Bin bin;
      ASSERT_TRUE(map.read(14, 0, bin));
      ASSERT_EQ(bin.sum, static_cast<std::int32_t>(bin.count) * (worst > 0 ? 511 : -511));
      ASSERT_EQ(bin.squares, bin.count * 511u * 511u);
    }
    ResidualMap::Bin other;
    ASSERT_TRUE(map.read(14, 1, other));
    EXPECT_EQ(other.count, 0u);
  }
}

TEST(ResidualMap, ResetEmptiesItAndEveryChangeShowsInItsVersion) {
  const auto c = made();
  ResidualMap map;
  const auto first = map.version();
  map.add(c, value(-0.3), turns(0.5), value(0.01));
  EXPECT_NE(map.version(), first);
  ResidualMap::Bin bin;
  ASSERT_TRUE(map.read(ResidualMap::velocity_bin(c, value(-0.3)), 16, bin));
  EXPECT_EQ(bin.count, 1u);
  const auto second = map.version();
  map.reset();
  EXPECT_NE(map.version(), second);
  ASSERT_TRUE(map.read(ResidualMap::velocity_bin(c, value(-0.3)), 16, bin));
  EXPECT_EQ(bin.count, 0u);
  EXPECT_EQ(bin.squares, 0u);
}

TEST(ResidualMap, ReportsSetupsThatDoNotFit) {
  OverflowLog::clear();
  made();
  EXPECT_EQ(OverflowLog::count(), 0);
  made(0.0);
  EXPECT_GT(OverflowLog::count(), 0);
  OverflowLog::clear();
  made(1e-6);
  EXPECT_GT(OverflowLog::count(), 0);
}

}  // namespace
}  // namespace flexspline::tests::control_residual_map_test
