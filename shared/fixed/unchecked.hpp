// The policy of the number system (system.hpp) on a drive: results that are safe by proof are taken as they are. And
// the product with a gain.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/types.hpp"
#include "shared/fixed/word.hpp"

namespace flexspline::fixed {

struct UncheckedArithmetic {
  static constexpr std::int32_t value(std::int64_t x) { return static_cast<std::int32_t>(x); }
  static constexpr std::int64_t state_sum(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
  }
  static constexpr std::int64_t state_difference(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  }
  // x 2^bits as a state.
  static constexpr std::int64_t state_shift(std::int64_t x, int bits) { return shift_right(x, -bits); }
  static constexpr void expect(bool, const char*) {}
};

// The input limited, times the gain: Q57, below 16.
constexpr std::int64_t product(const Gain& g, std::int32_t x) {
  const std::int32_t limited_x = limited_to(x, g.limit);
  return long_product(static_cast<std::int32_t>(static_cast<std::uint32_t>(limited_x) << g.up), g.factor);
}
inline constexpr int kProductBits = 57;

}  // namespace flexspline::fixed
