// A magnetic encoder AS5047 (14 bits a turn) on an SPI bus: two frames of 16 bits a tick, one for the angle and one for
// its diagnosis, without waiting for either (RM0090, 28; data sheet of the AS5047P, serial interface).
//
// The answer to a command comes with the next frame. The angle is taken while a tick begins and used by the next one:
// it is one tick old. A frame that does not come, has a wrong parity or an error, or a magnet that is too weak, gives
// no sample, and the age of the last one is a fault. With take_one() the angle is one PWM period old, and the magnet is
// checked in every 256th (12.8 ms).
#pragma once

#include <cstdint>

#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/registers.hpp"
#include "boards/stm32f4/unwrapped_angle.hpp"

namespace flexspline::stm32f4 {

template <std::uint32_t spi, const Pin& select>
class As5047 {
 public:
  static constexpr std::uint32_t kCounts = 1U << 14;

  void start(bool reversed) {
    angle_.reverse(reversed);
    switch_clock_on(spi);
    write(select, true);
    set_up_bus();
    begin(Command::angle);
  }
  // At the start of a tick. False: there is no new sample.
  bool take(std::uint32_t& count) {
    const bool fresh = fresh_;
    magnet_ = false;
    finish();  // the diagnosis
    begin(Command::diagnosis);
    if (!fresh || !magnet_) return false;
    count = angle_.total();
    return true;
  }
  // Instead of both for who calls once a PWM period: one frame a call, each 256th for the diagnosis. The angle is one
  // period old.
  bool take_one(std::uint32_t& count) {
    fresh_ = false;
    finish();
    begin(frames_++ % 256 == 0 ? Command::diagnosis : Command::angle);
    if (!fresh_ || !magnet_) return false;
    count = angle_.total();
    return true;
  }
  // At its end.
  void end_tick() {
    fresh_ = false;
    finish();  // the angle
    begin(Command::angle);
  }

 private:
  static constexpr std::uint32_t kControl = 0x00, kStatus = 0x08, kData = 0x0C;
  static constexpr std::uint32_t kCame = 1U << 0, kOn = 1U << 6;
  // Registers 0x3FFF, 0x3FFC and 0x0001, read, with even parity. Reading the errors clears the flag of an error.
  enum class Command : std::uint16_t { none = 0, angle = 0xFFFF, diagnosis = 0xFFFC, errors = 0x4001 };
  static constexpr std::uint32_t kError = 1U << 14;
  // Offsets compensated; no overflow of its arithmetic; the field is not too weak.
  static constexpr std::uint32_t kMagnetBits = (1U << 8) | (1U << 9) | (1U << 11), kMagnetGood = 1U << 8;
  // 350 ns from the selection to the first clock, and between two frames.
  static constexpr std::uint32_t kSelectCycles = 60;

  // Master, 16 bits, data at the second edge, a sixteenth of its bus: 5.25 MHz of at most 10, half of it on APB1.
  static void set_up_bus() {
    hardware(spi + kControl) = 0;
    hardware(spi + kControl) = (1U << 11) | (3U << 8) | (3U << 3) | (1U << 2) | (1U << 0);
    set_bits(spi + kControl, kOn);
  }
  void begin(Command command) {
    answered_ = sent_;
    sent_ = has_error_ ? Command::errors : command;
    has_error_ = false;
    write(select, false);
    cortex_m4::spend_cycles(kSelectCycles);
    hardware(spi + kData) = static_cast<std::uint32_t>(sent_);
  }
  // Takes the answer, if it came and is good. 16 bits take 3 us, which have passed.
  void finish() {
    const bool came = (hardware(spi + kStatus) & kCame) != 0;
    const std::uint32_t answer = came ? hardware(spi + kData) & 0xFFFF : 0;
    write(select, true);
    cortex_m4::spend_cycles(kSelectCycles);
    if (!came) return set_up_bus();
    // Answers from before the errors were read have the flag as well.
    const bool is_flagged = (answer & kError) != 0;
    has_error_ = is_flagged && sent_ != Command::errors && answered_ != Command::errors;
    if (is_flagged || __builtin_parity(answer) != 0) return;
    if (answered_ == Command::diagnosis) magnet_ = (answer & kMagnetBits) == kMagnetGood;
    if (answered_ == Command::angle) {
      angle_.add(answer & (kCounts - 1));
      fresh_ = true;
    }
  }

  UnwrappedAngle<kCounts> angle_{};
  // The answer to a command comes with the next frame. All members are zero at first, or the whole drive would take
  // flash memory for its initial value.
  std::uint8_t frames_ = 0;
  Command sent_ = Command::none, answered_ = Command::none;
  bool has_error_ = false;
  bool fresh_ = false;
  bool magnet_ = false;
};

}  // namespace flexspline::stm32f4
