// Numbers from sums of samples, against double and against a winding that is solved exactly.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "shared/control/commissioning/estimators.hpp"

namespace flexspline::control::commissioning::commissioning_estimators_test {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
}

TEST(CommissioningEstimators, ARatioIsThatOfDoubleAndHeldAtAWord) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 20000; ++k) {
    const auto a = static_cast<std::int64_t>(random()) >> (random() % 62 + 1);
    const auto b = static_cast<std::int64_t>(random()) >> (random() % 62 + 1);
    const int bits = static_cast<int>(random() % 30);
    if (b == 0) continue;
    const double exact = std::ldexp(static_cast<double>(a) / static_cast<double>(b), bits);
    const double held = std::clamp(exact, -2147483647.0, 2147483647.0);
    EXPECT_NEAR(ratio(a, b, bits), held, 1.0 + std::abs(held) * std::ldexp(1.0, -29)) << a << "/" << b;
  }
  EXPECT_EQ(ratio(1, 0, 4), 16);
  EXPECT_EQ(ratio(0, 5, 20), 0);
}

TEST(CommissioningEstimators, TheAngleOfAVectorIsThatOfTheArcTangent) {
  std::mt19937_64 random(4);
  for (int k = 0; k < 5000; ++k) {
    const double turns = uniform(random, -0.5, 0.5), length = std::exp(uniform(random, std::log(1e6), std::log(4e8)));
    const auto y = static_cast<std::int32_t>(std::lround(length * std::sin(2.0 * std::numbers::pi * turns)));
    const auto x = static_cast<std::int32_t>(std::lround(length * std::cos(2.0 * std::numbers::pi * turns)));
    const double found = std::ldexp(static_cast<double>(angle_of(y, x)), -32) - turns;
    EXPECT_NEAR(found - std::round(found), 0.0, 3e-6) << x << " " << y;
  }
}

// A winding of R and L whose voltage stands for a period; sampled in the middle of it.
double inductance_found(double resistance, double inductance, double amplitude, double offset) {
  const double half = std::exp(-resistance / inductance / 2.0);
  double current = offset / resistance;
  Impedance impedance;
  const int settling = 4096;
  for (int k = 0; !impedance.done(); ++k) {
    const double voltage = amplitude * std::cos(2.0 * std::numbers::pi * k / 8.0) + offset;
    const auto step = [&](double i) { return half * i + (1.0 - half) * voltage / resistance; };
    const double middle = step(current);
    current = step(middle);
    if (k < settling) continue;
    impedance.add(static_cast<std::int32_t>(std::lround(std::ldexp(voltage, 28))),
                  static_cast<std::int32_t>(std::lround(std::ldexp(middle, 27))));
  }
  return std::ldexp(impedance.inductance(static_cast<std::int32_t>(std::lround(std::ldexp(resistance, kSharesBits)))),
                    -kSharesBits);
}
TEST(CommissioningEstimators, AnInjectedVoltageGivesTheInductanceFromAFewPeriodsOfTimeConstantOn) {
  for (const double inductance : {0.2, 1.0, 5.0, 30.0})
    for (const double periods : {2.0, 4.0, 20.0, 200.0}) {
      const double resistance = inductance / periods, offset = 0.2 * std::min(1.0, resistance);
      const double found = inductance_found(resistance, inductance, std::min(0.1, 0.05 * inductance), offset);
      EXPECT_NEAR(found / inductance, 1.0, 0.003) << inductance << " " << periods;
    }
}

TEST(CommissioningEstimators, GainsOfThreeSensorsAreFoundUpToWhatTheyHaveInCommon) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 200; ++k) {
    double g[3];
    for (double& x : g) x = uniform(random, 0.85, 1.15);
    PhaseMeans m[3];
    for (int direction = 0; direction < 3; ++direction) {
      const double size = uniform(random, 2e7, 5e7);
      const auto reading = [&](int phase) {
        return static_cast<std::int64_t>(std::lround(size * g[phase] * (phase == direction ? 1.0 : -0.5)));
      };
      m[direction] = {reading(0), reading(1), reading(2)};
    }
    const foc::Phases by = gain_corrections(m[0], m[1], m[2]);
    const double mean = (1.0 / g[0] + 1.0 / g[1] + 1.0 / g[2]) / 3.0;
    EXPECT_NEAR(by.a / 4096.0, 1.0 / g[0] / mean, 3e-4);
    EXPECT_NEAR(by.b / 4096.0, 1.0 / g[1] / mean, 3e-4);
    EXPECT_NEAR(by.c / 4096.0, 1.0 / g[2] / mean, 3e-4);
  }
}

TEST(CommissioningEstimators, AnAxisThatReluctanceTurnedAwayIsPutRightAndAGoodOneIsLeft) {
  const double d = 2.0, unit = std::ldexp(1.0, kSharesBits);
  for (const double q : {1.0, 1.5, 2.0, 2.6, 4.0})
    for (const double degrees : {-75.0, -40.0, -10.0, 0.0, 1.0, 25.0, 70.0}) {
      // Where Lq is not the larger one, nothing turns the rotor away.
      const bool away = q > 1.2 * d && std::abs(degrees) > 4.0;
      if (q <= 1.2 * d && std::abs(degrees) > 1.5) continue;
      const double e = degrees / 180.0 * std::numbers::pi;
      const auto along = [&](double turns) {
        const double c = std::cos(2.0 * std::numbers::pi * turns - e), s = std::sin(2.0 * std::numbers::pi * turns - e);
        return static_cast<std::int32_t>(std::lround(unit / (c * c / d + s * s / q)));
      };
      const Inductances found = inductances_of(along(0.0), along(0.125), along(0.25), 0);
      EXPECT_NEAR(std::ldexp(found.off, -32) * 360.0, away ? degrees : 0.0, 0.01) << q << " " << degrees;
      // A rotor that has moved by a little since, as its encoder shows, is measured where it is.
      const auto moved = static_cast<std::int32_t>(std::lround(std::ldexp(degrees / 360.0, 32)));
      const Inductances there = inductances_of(along(0.0), along(0.125), along(0.25), moved);
      EXPECT_EQ(there.off, 0);
      EXPECT_NEAR(there.d / unit, d, 1e-5);
      EXPECT_NEAR(found.d / unit, d, 0.01 * d) << q << " " << degrees;
      EXPECT_NEAR(found.q / unit, q, 0.01 * q) << q << " " << degrees;
    }
}

}  // namespace
}  // namespace flexspline::control::commissioning::commissioning_estimators_test
