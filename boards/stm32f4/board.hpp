// The board type for the application's template (firmware/board.hpp), made from the description of a board. A
// description has: kClock, kPins, kAnalog, kHardware, kParameterSector, kPairingSector, kMotorReversed,
// kOutputReversed, kName, and types MotorEncoder, OutputEncoder, Amplifier, Serial and Usb (NoUsb where there is none).
#pragma once

#include <cstdint>

#include "boards/stm32f4/amplifier.hpp"
#include "boards/stm32f4/analog.hpp"
#include "boards/stm32f4/brown_out.hpp"
#include "boards/stm32f4/clock.hpp"
#include "boards/stm32f4/encoder.hpp"
#include "boards/stm32f4/flash.hpp"
#include "boards/stm32f4/handover.hpp"
#include "boards/stm32f4/otg_fs.hpp"
#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/usart.hpp"
#include "boards/stm32f4/watchdog.hpp"
#include "firmware/board.hpp"

namespace flexspline::stm32f4 {

template <class Description>
class DriveBoard {
 public:
  static constexpr std::uint32_t kTickHz = 20'000;
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
  // The control tick starts here.
  void start_tick() {
    Analog::start(Description::kAnalog);
    motor_.start(Description::kMotorReversed);
    output_.start(Description::kOutputReversed);
    amplifier_.start(Description::kClock.core_hz / kTickHz / 2);
  }
  bool clock_is_exact() const { return source_ == ClockSource::crystal; }

  // Called from the tick.

  const firmware::Readings& read() {
    tim1::take_tick();
    if (Analog::ended()) {
      Analog::take();
      readings_.current = bipolar_share(Analog::result(0), Description::kAnalog.current_falls);
      readings_.torque = bipolar_share(Analog::result(1), Description::kAnalog.torque_falls);
      readings_.temperature = unipolar_share(Analog::result(2));
      ++readings_.analog_samples;
    }
    if (motor_.take(readings_.motor_counter)) ++readings_.motor_samples;
    if (output_.take(readings_.output_counter)) ++readings_.output_samples;
    if constexpr (requires { motor_.take_index(readings_.index_counter); })
      if (motor_.take_index(readings_.index_counter)) ++readings_.index_passes;
    return readings_;
  }
  // After the tick.
  void end_tick() {
    end_tick_of(motor_);
    end_tick_of(output_);
  }
  void actuate(const firmware::Actuation& command) {
    amplifier_.actuate(command, readings_.current);
    enabled_ = command.enabled;
  }
  static constexpr control::Hardware hardware() { return Description::kHardware; }
  bool amplifier_tripped() const { return amplifier_.tripped(); }
  // The next tick is due already.
  bool tick_overrun() {
    if (late_ticks_ > 0) {
      late_ticks_ = static_cast<std::uint8_t>(late_ticks_ - 1);
      return false;
    }
    return tim1::tick_is_due();
  }

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
  // The flash memory stops the processor: the ticks after that begin late, which is not counted as an overrun. The
  // service writes only while the amplifier is off.
  void flash_works() { late_ticks_ = 2; }

 private:
  template <class Encoder>
  static void end_tick_of(Encoder& encoder) {
    if constexpr (requires { encoder.end_tick(); }) encoder.end_tick();
  }

  typename Description::MotorEncoder motor_{};
  typename Description::OutputEncoder output_{};
  typename Description::Amplifier amplifier_{};
  IndependentWatchdog<kTickHz> watchdog_{};
  firmware::Readings readings_{};
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
