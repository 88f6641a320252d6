// A half bridge for a brake resistor between its output and ground, on channels 3 (low side) and 4 (high side) of a
// general timer that counts up and down at the PWM rate; the dead time is between two compare values (RM0090, 18).
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

template <std::uint32_t timer, std::uint32_t timer_hz, std::uint32_t pwm_hz>
class BrakeOutput {
 public:
  // Low side on, which carries nothing and charges the high side's supply.
  static void start() {
    switch_clock_on(timer);
    hardware(timer + kReload) = kHalf;
    // With preload: the low side in PWM mode 1, around the bottom; the high side in mode 2, around the top.
    hardware(timer + kMode34) = 0x7868;
    set(0);
    hardware(timer + kEvent) = 1;
    hardware(timer + kOutputs) = (1U << 8) | (1U << 12);
    hardware(timer) = (1U << 7) | (1U << 5) | 1U;
  }
  // Share of the period, 2^-15.
  static void set(std::int32_t share) {
    const std::uint32_t on = (static_cast<std::uint32_t>(share) * kHalf) >> 15;
    hardware(timer + kHigh) = on == 0 ? kHalf + 1 : kHalf - on;
    hardware(timer + kLow) = on == 0 ? kHalf + 1 : on + kDead < kHalf ? kHalf - on - kDead : 0;
  }
  // Both inputs of its driver are pulled down then.
  static void cut() { hardware(timer + kOutputs) = 0; }

 private:
  static constexpr std::uint32_t kHalf = timer_hz / pwm_hz / 2, kDead = timer_hz / 2'000'000;  // 500 ns
  static constexpr std::uint32_t kEvent = 0x14, kMode34 = 0x1C, kOutputs = 0x20, kReload = 0x2C, kLow = 0x3C,
                                 kHigh = 0x40;
};

}  // namespace flexspline::stm32f4
