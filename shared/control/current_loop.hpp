// The innermost loop, for a board whose amplifier is a bridge: proportional and integral, from the difference of
// commanded and measured current to a share of the supply voltage. Integers; the integral is its only state.
#pragma once

#include <cstdint>

namespace flexspline::control {

// Gains are supply shares for each share of the amplifier's full scale, in 2^-8; the integral one for each tick, in
// 2^-16. For a winding of R and L with full-scale current I on a supply of U, a loop with the corner w has
// proportional = 256 w L I / U and integral = 65536 w R I / (U f), f ticks a second.
struct CurrentLoopSetup {
  std::int32_t proportional = 0;  // below 2^14
  std::int32_t integral = 0;      // below 2^14
  std::int32_t limit = 32767;     // of the result, 2^-15
};

class CurrentLoop {
 public:
  void reset() { sum_ = 0; }
  // All are shares in 2^-15. The integral stops at the limit (anti-windup).
  std::int32_t update(const CurrentLoopSetup& setup, std::int32_t reference, std::int32_t measured) {
    const std::int64_t error = reference - measured, before = sum_;
    const std::int64_t most = std::int64_t{setup.limit} << 16;
    sum_ += setup.integral * error;
    const std::int64_t all = ((setup.proportional * error) << 8) + sum_;
    if (all <= most && all >= -most) return static_cast<std::int32_t>(all >> 16);
    if ((error > 0) == (all > 0)) sum_ = before;
    return all > 0 ? setup.limit : -setup.limit;
  }

 private:
  std::int64_t sum_ = 0;  // 2^-31
};

}  // namespace flexspline::control
