// The drive's number system with a check of every step that is safe by proof. For the host and for tests.
#pragma once

#include <cstdint>
#include <limits>

#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::fixed {

// The same bits as `UncheckedArithmetic`; OverflowLog has the results that left their range.
struct CheckedArithmetic {
  static std::int32_t value(std::int64_t x) {
    const auto narrowed = static_cast<std::int32_t>(x);
    expect(narrowed == x, "a value leaves its range");
    return narrowed;
  }
  static std::int64_t state_sum(std::int64_t a, std::int64_t b) {
    const std::int64_t sum = UncheckedArithmetic::state_sum(a, b);
    expect((a < 0) != (b < 0) || (sum < 0) == (a < 0), "a sum of states leaves its range");
    return sum;
  }
  static std::int64_t state_difference(std::int64_t a, std::int64_t b) {
    const std::int64_t difference = UncheckedArithmetic::state_difference(a, b);
    expect((a < 0) == (b < 0) || (difference < 0) == (a < 0), "a sum of states leaves its range");
    return difference;
  }
  static std::int64_t state_shift(std::int64_t x, int bits) {
    const std::int64_t shifted = UncheckedArithmetic::state_shift(x, bits);
    expect(shift_right(shifted, bits) == x, "a value does not fit a state");
    return shifted;
  }
  static void expect(bool holds, const char* what) {
    if (!holds) OverflowLog::note(what);
  }
};

using Checked = FixedSystem<CheckedArithmetic>;

}  // namespace flexspline::fixed
