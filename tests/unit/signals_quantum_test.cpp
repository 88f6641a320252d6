// The step of an encoder is found in numbers that were written with few decimals, too.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "host/common/signals/quantum.hpp"

namespace flexspline::signals::signals_quantum_test {
namespace {

// A slow sine, rounded to steps, then to decimals; zero: not rounded.
std::vector<double> sine(double amplitude, double step, double decimal) {
  std::vector<double> signal;
  for (int k = 0; k < 4000; ++k) {
    double x = amplitude * std::sin(2e-3 * k) + 0.1 * amplitude * std::sin(0.031 * k);
    if (step > 0.0) x = step * std::round(x / step);
    signal.push_back(decimal > 0.0 ? decimal * std::round(x / decimal) : x);
  }
  return signal;
}

TEST(Quantum, IsTheStepOfARoundedSignal) {
  EXPECT_NEAR(quantum_of(sine(0.5, 1e-4, 0.0)).value(), 1e-4, 1e-9);
}

TEST(Quantum, IsFoundBehindFewDecimalsWhereStepsAreNoMultiplesOfTheLastOne) {
  const double motor = 2.0 * std::numbers::pi / 20000.0, output = 2.0 * std::numbers::pi / (1 << 20);
  EXPECT_NEAR(quantum_of(sine(2.0, motor, 1e-7)).value(), motor, 1e-3 * motor);
  EXPECT_NEAR(quantum_of(sine(0.02, output, 1e-7)).value(), output, 2e-3 * output);
}

TEST(Quantum, IsTheLastDecimalWhereThatIsCoarserThanTheSteps) {
  EXPECT_NEAR(quantum_of(sine(0.05, 0.0, 1e-4)).value(), 1e-4, 1e-9);
}

TEST(Quantum, IsNoneOfASmoothSignalWhateverItsDecimals) {
  EXPECT_FALSE(quantum_of(sine(0.5, 0.0, 0.0)).has_value());
  EXPECT_FALSE(quantum_of(sine(0.5, 0.0, 1e-7)).has_value());
}

TEST(Quantum, IsNoneOfNoise) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> noise;
  for (int k = 0; k < 4000; ++k) noise.push_back(1e-6 * std::round(1e6 * normal(random)));
  EXPECT_FALSE(quantum_of(noise).has_value());
}

// As linear interpolation between samples at uneven times does it.
TEST(Quantum, IsNoneOfARoundedSignalThatWasResampled) {
  const std::vector<double> rounded = sine(0.5, 1e-3, 0.0);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(0.0, 0.1);
  std::vector<double> resampled;
  for (std::size_t k = 1; k < rounded.size(); ++k)
    resampled.push_back(rounded[k] + share(random) * (rounded[k - 1] - rounded[k]));
  EXPECT_FALSE(quantum_of(resampled).has_value());
}

TEST(Quantum, IsNotTheRoundingOfFloatingPoint) {
  std::vector<double> signal;
  for (int k = 0; k < 4000; ++k) signal.push_back(k % 4 == 0 ? 0.3 * k : signal.back() * (1.0 + 3e-16));
  EXPECT_FALSE(quantum_of(signal).has_value());
}

TEST(Quantum, NeedsSomeSteps) {
  EXPECT_FALSE(quantum_of(std::vector<double>{0.0, 1.0, 2.0, 2.0}).has_value());
  EXPECT_FALSE(quantum_of({}).has_value());
}

}  // namespace
}  // namespace flexspline::signals::signals_quantum_test
