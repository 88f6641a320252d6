#include "hil/plant/normal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace flexspline::plant::plant_normal_test {
namespace {

// One number at a time, as the method is told, from the standard library's words.
class OneByOne {
 public:
  explicit OneByOne(std::uint64_t seed) : generator_(seed) {}
  double next() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    double x = 0.0, y = 0.0, square = 0.0;
    do {
      x = 2.0 * share() - 1.0;
      y = 2.0 * share() - 1.0;
      square = x * x + y * y;
    } while (square > 1.0 || square == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    second_ = x * factor;
    has_second_ = true;
    return y * factor;
  }

 private:
  double share() {
    const double share = static_cast<double>(generator_()) * 0x1p-64;
    return share < 1.0 ? share : 1.0 - 0x1p-53;
  }
  std::mt19937_64 generator_;
  double second_ = 0.0;
  bool has_second_ = false;
};

TEST(PlantNormal, NumbersMadeByHundredsAreThoseMadeOneByOneToTheBit) {
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{5489}, ~std::uint64_t{0}}) {
    OneByOne expected(seed);
    Normal normal(seed);
    for (int k = 0; k < 20'000; ++k) ASSERT_EQ(normal(), expected.next()) << "number " << k << " of seed " << seed;
  }
}

TEST(PlantNormal, NumbersHaveTheMomentsOfAStandardNormalDistribution) {
  constexpr int kCount = 400'000;
  Normal normal(17);
  double sum = 0.0, squares = 0.0, fourth = 0.0, neighbours = 0.0, before = 0.0;
  int beyond_two = 0;
  for (int k = 0; k < kCount; ++k) {
    const double x = normal();
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
    neighbours += x * before;
    before = x;
    beyond_two += std::abs(x) > 2.0 ? 1 : 0;
  }
  // Each within four standard deviations of itself.
  const double root = std::sqrt(1.0 * kCount);
  EXPECT_NEAR(sum / kCount, 0.0, 4.0 / root);
  EXPECT_NEAR(squares / kCount, 1.0, 4.0 * std::sqrt(2.0) / root);
  EXPECT_NEAR(fourth / kCount, 3.0, 4.0 * std::sqrt(96.0) / root);
  EXPECT_NEAR(neighbours / kCount, 0.0, 4.0 / root);
  EXPECT_NEAR(beyond_two / (1.0 * kCount), 0.0455, 4.0 * 0.2084 / root);
}

}  // namespace
}  // namespace flexspline::plant::plant_normal_test
