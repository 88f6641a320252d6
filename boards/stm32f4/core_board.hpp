// What every board on these chips has, whatever its amplifier: pins and clock, the watchdog, what the last reset was.
#pragma once

#include <cstdint>

#include "boards/stm32f4/brown_out.hpp"
#include "boards/stm32f4/clock.hpp"
#include "boards/stm32f4/handover.hpp"
#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/watchdog.hpp"
#include "firmware/board.hpp"

namespace flexspline::stm32f4 {

template <class Description, std::uint32_t tick_hz>
class CoreBoard {
 public:
  static constexpr std::uint32_t kTickHz = tick_hz;
  static constexpr std::uint32_t kTelemetryWords = 4096;
  static constexpr std::uint32_t kOutputSampleTicks = [] {
    if constexpr (requires { Description::OutputEncoder::kSampleTicks; }) {
      return Description::OutputEncoder::kSampleTicks;
    } else {
      return 1;
    }
  }();

  // Pins and clock first: the amplifier is off from the first instructions on. False: no clock that a drive can run on.
  bool start_clock() {
    static_assert(Description::kClock.core_hz > 150'000'000 && Description::kClock.core_hz <= 168'000'000,
                  "the PLL's and the converter's dividers are for 150 to 168 MHz: boards/PORTING.md, step 3");
    static_assert(is_even_megahertz(Description::kClock.crystal_hz) && is_even_megahertz(Description::kClock.core_hz),
                  "crystal and core's clock have to be multiples of 2 MHz: boards/PORTING.md, step 3");
    static_assert(!Description::kHasUsb || makes_usb_clock(Description::kClock),
                  "with USB the core's clock has to be 168 MHz: boards/PORTING.md, step 3");
    static_assert(Description::kName.size() <= 15, "kName has more than 15 letters: boards/PORTING.md, step 2");
    const bool crashed = crash_was_noted();
    cause_ = watchdog_was_the_reset() ? firmware::ResetCause::watchdog
             : crashed                ? firmware::ResetCause::crash
                                      : firmware::ResetCause::power;
    set_up(Description::kPins);
    source_ = Clock::start(Description::kClock);
    // With its longest limit, before the first tick: a hang in start-up leads to a reset as well.
    if (source_ != ClockSource::bare) watchdog_.start();
    // Elsewhere the boot loader does it.
    if constexpr (!Description::kHasUsb) set_brown_out_level();
    return source_ != ClockSource::bare;
  }
  bool clock_is_exact() const { return source_ == ClockSource::crystal; }
  static constexpr control::Hardware hardware() { return Description::kHardware; }

  // Called from background work.

  void feed_watchdog() { watchdog_.feed(enabled_); }
  firmware::ResetCause reset_cause() const { return cause_; }
  static firmware::RandomWords random_words() {
    if constexpr (requires { typename Description::Random; }) {
      return Description::Random::take();
    } else {
      return {};
    }
  }
  // The flash memory stops the processor: the ticks after that begin late, which is not counted as an overrun. Each
  // operation has all the time of the watchdog, as two sectors in a row may take longer. The service writes only while
  // the amplifier is off.
  void flash_works() {
    late_ticks_ = 2;
    if (!enabled_) watchdog_.feed(false);
  }

 protected:
  template <class Encoder>
  static void end_tick_of(Encoder& encoder) {
    if constexpr (requires { encoder.end_tick(); }) encoder.end_tick();
  }
  // Whether a tick that began late is to be forgiven, once for each.
  bool was_delayed() {
    if (late_ticks_ == 0) return false;
    late_ticks_ = static_cast<std::uint8_t>(late_ticks_ - 1);
    return true;
  }
  void note_enabled(bool enabled) { enabled_ = enabled; }

 private:
  IndependentWatchdog<kTickHz> watchdog_{};
  ClockSource source_ = ClockSource::bare;
  firmware::ResetCause cause_ = firmware::ResetCause::power;
  volatile bool enabled_ = false;
  volatile std::uint8_t late_ticks_ = 0;
};

// Twelve hexadecimal digits of the chip's serial number, as the ROM's boot loader shows it.
inline void serial_number(char (&text)[13]) {
  const std::uint32_t words[] = {hardware(kUniqueId) + hardware(kUniqueId + 8), hardware(kUniqueId + 4) >> 16};
  for (std::uint32_t i = 0; i < 12; ++i) {
    const std::uint32_t digit = i < 8 ? words[0] >> (28 - 4 * i) & 15 : words[1] >> (44 - 4 * i) & 15;
    text[i] = static_cast<char>(digit < 10 ? '0' + digit : 'A' + digit - 10);
  }
  text[12] = 0;
}

}  // namespace flexspline::stm32f4
