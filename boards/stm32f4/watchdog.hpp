// The independent watchdog: an oscillator and a counter of their own, which reset the processor and so open all
// switches (RM0090, 21). Once started it cannot be stopped.
//
// Its oscillator has 17 to 47 kHz. While the amplifier is on, the limit is kWatchdogTicks even for the slowest; while
// it is off the limit is some seconds, as erasing a sector of 128 KB stops the processor for up to two.
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"
#include "firmware/faults.hpp"

namespace flexspline::stm32f4 {

template <std::uint32_t tick_hz>
class IndependentWatchdog {
 public:
  void start() {
    hardware(kIwdg) = kStart;
    set_limit(false);
  }
  // From background work, when every part has reported, and around each operation of the flash memory.
  void feed(bool amplifier_on) {
    if (amplifier_on != short_) set_limit(amplifier_on);
    hardware(kIwdg) = kFeed;
  }

 private:
  static constexpr std::uint32_t kPrescaler = kIwdg + 0x04, kReload = kIwdg + 0x08, kStatus = kIwdg + 0x0C;
  static constexpr std::uint32_t kFeed = 0xAAAA, kUnlock = 0x5555, kStart = 0xCCCC;
  static constexpr std::uint32_t kSlowestHz = 17'000;
  static constexpr std::uint32_t kShort = kSlowestHz / 4 * firmware::kWatchdogTicks / tick_hz - 1;
  static_assert(kShort > 10 && kShort < 4096);
  // An update takes five cycles of the oscillator; an iteration at least 0.1 us.
  static constexpr std::uint32_t kTries = 20'000;

  // Divided by 4, or by 32, where 4096 counts are 2.8 s at the fastest.
  void set_limit(bool is_short) {
    if (!wait_for(kStatus, 3, 0, kTries)) return;  // the previous change is not finished: the next feed tries again
    hardware(kIwdg) = kUnlock;
    hardware(kPrescaler) = is_short ? 0 : 3;
    hardware(kReload) = is_short ? kShort : 0xFFF;
    short_ = is_short;
  }
  bool short_ = false;
};

}  // namespace flexspline::stm32f4
