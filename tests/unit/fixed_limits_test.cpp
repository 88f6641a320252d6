// The functions that the control tick limits and rounds with, compared with plain arithmetic of more bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/word.hpp"

namespace flexspline::tests::fixed_limits_test {
namespace {

__extension__ using Wide = __int128;

// Of every size, and close to both ends.
std::int64_t any(std::mt19937_64& random, int bits) {
  const auto x = static_cast<std::int64_t>(random());
  const auto sized = x >> (64 - bits) >> (random() % static_cast<unsigned>(bits));
  return random() % 8 == 0 ? (x < 0 ? INT64_MIN : INT64_MAX) >> (64 - bits) : sized;
}

TEST(Limits, LimitToBothSidesForEveryInput) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 1'000'000; ++i) {
    const auto word = static_cast<std::int32_t>(any(random, 32));
    const auto most = static_cast<std::int32_t>(std::max<std::int64_t>(any(random, 32), 0));
    ASSERT_EQ(fixed::limited_to(word, most), std::clamp(word, -most, most)) << word << ' ' << most;
    const std::int64_t x = any(random, 64), limit = std::max<std::int64_t>(any(random, 64), 0);
    ASSERT_EQ(fixed::limited_to(x, limit), std::clamp(x, -limit, limit)) << x << ' ' << limit;
  }
}

TEST(Limits, AShiftRoundsHalvesUp) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 1'000'000; ++i) {
    const std::int64_t x = any(random, 61), y = any(random, 43);
    ASSERT_EQ(fixed::rounded_shift<30>(x), static_cast<std::int32_t>((Wide{x} + (Wide{1} << 29)) >> 30)) << x;
    ASSERT_EQ(fixed::rounded_shift<12>(y), static_cast<std::int32_t>((Wide{y} + (Wide{1} << 11)) >> 12)) << y;
  }
}

TEST(Limits, AProductWithAWordRoundsAsTheLongOneDoes) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 1'000'000; ++i) {
    const std::int64_t a = any(random, 56);
    const auto word = static_cast<std::int32_t>(any(random, 32));
    ASSERT_EQ(fixed::multiply_word_round(a, word, 27), fixed::multiply_round(a, word, 27)) << a << ' ' << word;
  }
}

}  // namespace
}  // namespace flexspline::tests::fixed_limits_test
