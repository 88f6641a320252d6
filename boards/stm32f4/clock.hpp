// The core's clock from a crystal (or the clock of another chip) over the PLL. Where the crystal is dead the internal
// oscillator drives the same PLL: its error of one percent is too large for USB, but the drive's loops run at the same
// rate. No wait here is unlimited (RM0090, 7.2 and 3.5.1).
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

struct ClockSetup {
  std::uint32_t crystal_hz = 8'000'000;
  bool bypass = false;        // the pin gets a clock, not a crystal
  std::uint32_t core_hz = 0;  // at most 168 MHz (no overdrive); USB needs a PLL of 48 MHz times a whole number
};

// The PLL divides the crystal to 2 MHz and the VCO, twice the core's clock, to USB's 48 MHz.
constexpr bool is_even_megahertz(std::uint32_t hz) {
  return hz > 0 && hz % 2'000'000 == 0;
}
constexpr bool makes_usb_clock(const ClockSetup& c) {
  return 2 * c.core_hz % 48'000'000 == 0;
}
static_assert(is_even_megahertz(8'000'000) && !is_even_megahertz(25'000'000) && !is_even_megahertz(0));
static_assert(makes_usb_clock({.core_hz = 168'000'000}) && !makes_usb_clock({.core_hz = 160'000'000}));

enum class ClockSource : std::uint8_t {
  bare,  // 16 MHz as after reset: the PLL is dead, and that is too slow for a drive
  crystal,
  internal,  // the crystal is dead: no USB
};

inline constexpr std::uint32_t kInternalHz = 16'000'000;

// The PLL's numbers: input 2 MHz (least jitter), VCO of twice the core.
constexpr std::uint32_t pll_setup(const ClockSetup& c, std::uint32_t input_hz, bool from_crystal) {
  const std::uint32_t m = input_hz / 2'000'000, n = c.core_hz / 1'000'000,
                      q = (2 * c.core_hz + 47'999'999) / 48'000'000;
  // P = 2; R (F446 only) at its reset value.
  return m | (n << 6) | (from_crystal ? 1U << 22 : 0U) | (q << 24) | (2U << 28);
}

class Clock {
 public:
  // After reset, or after a boot loader that set the same clock.
  static ClockSource start(const ClockSetup& c) {
    switch_clock_on(kPower);
    set_bits(kControl, kInternalOn);
    if (!wait_for(kControl, kInternalOn << 1, kInternalOn << 1, kSwitchTries)) return ClockSource::bare;
    change_bits(kConfiguration, kSwitchField, 0);
    if (!wait_for(kConfiguration, kSwitchField << 2, 0, kSwitchTries)) return ClockSource::bare;
    set_bits(kControl, kCrystalOn | (c.bypass ? kCrystalBypass : 0U));
    const bool crystal = wait_for(kControl, kCrystalReady, kCrystalReady, kCrystalTries);
    if (!crystal) clear_bits(kControl, kCrystalOn);
    if (crystal && run_pll(pll_setup(c, c.crystal_hz, true))) {
      // A crystal that dies later: the core goes on at 16 MHz and gets an NMI, and TIM1 a break.
      set_bits(kControl, kSecurityOn);
      return ClockSource::crystal;
    }
    return run_pll(pll_setup(c, kInternalHz, false)) ? ClockSource::internal : ClockSource::bare;
  }

 private:
  static constexpr std::uint32_t kControl = kRcc, kPll = kRcc + 0x04, kConfiguration = kRcc + 0x08,
                                 kFlashAccess = kFlash;
  static constexpr std::uint32_t kInternalOn = 1U << 0, kCrystalOn = 1U << 16, kCrystalReady = 1U << 17,
                                 kCrystalBypass = 1U << 18, kSecurityOn = 1U << 19, kPllOn = 1U << 24,
                                 kPllReady = 1U << 25;
  // A crystal starts within some milliseconds, the PLL locks within 0.3 ms; an iteration takes at least 0.3 us.
  static constexpr std::uint32_t kCrystalTries = 100'000, kPllTries = 10'000, kSwitchTries = 1'000;
  // AHB undivided; APB1 a quarter, APB2 a half: 42 and 84 MHz at most.
  static constexpr std::uint32_t kDividers = (5U << 10) | (4U << 13), kDividerFields = 0xFCF0;
  static constexpr std::uint32_t kSwitchField = 3, kFromPll = 2;
  // Five wait states (2.7 to 3.6 V, above 150 MHz), prefetch, both caches.
  static constexpr std::uint32_t kWaitStates = 5 | (7U << 8);

  static bool run_pll(std::uint32_t setup) {
    clear_bits(kControl, kPllOn);
    if (!wait_for(kControl, kPllReady, 0, kPllTries)) return false;
    hardware(kPll) = setup;
    set_bits(kControl, kPllOn);
    if (!wait_for(kControl, kPllReady, kPllReady, kPllTries)) return false;
    hardware(kFlashAccess) = kWaitStates;
    if (!wait_for(kFlashAccess, 0xF, 5, kSwitchTries)) return false;
    change_bits(kConfiguration, kDividerFields, kDividers);
    change_bits(kConfiguration, kSwitchField, kFromPll);
    return wait_for(kConfiguration, kSwitchField << 2, kFromPll << 2, kSwitchTries);
  }
};

// What reset the processor (RM0090, 7.3.21). Reading clears it.
inline bool watchdog_was_the_reset() {
  constexpr std::uint32_t kStatus = kRcc + 0x74, kWatchdogReset = 1U << 29, kForget = 1U << 24;
  const bool watchdog = (hardware(kStatus) & kWatchdogReset) != 0;
  set_bits(kStatus, kForget);
  return watchdog;
}

}  // namespace flexspline::stm32f4
