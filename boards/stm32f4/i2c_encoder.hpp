// A magnetic encoder AS5600 (12 bits a turn) on an I2C bus of 400 kHz: its status and its angle again and again, a step
// of the transfer at a time and without waiting (RM0090, 27; data sheet of the AS5600).
//
// A sample takes some ticks: kSampleTicks at most. It is for the output, which turns slowly. An encoder that does not
// answer or has no magnet gives no sample, and the age of the last one is a fault.
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"
#include "boards/stm32f4/unwrapped_angle.hpp"

namespace flexspline::stm32f4 {

template <std::uint32_t i2c, std::uint32_t bus_hz>
class As5600 {
 public:
  static constexpr std::uint32_t kCounts = 1U << 12;
  static constexpr std::uint32_t kSampleTicks = 20;

  void start(bool reversed) {
    angle_.reverse(reversed);
    switch_clock_on(i2c);
    set_up_bus();
  }
  // At the start of a tick. False: there is no new sample.
  bool take(std::uint32_t& count) {
    step();
    if (!fresh_) return false;
    fresh_ = false;
    count = angle_.total();
    return true;
  }
  // At its end.
  void end_tick() { step(); }

 private:
  static constexpr std::uint32_t kControl1 = 0x00, kControl2 = 0x04, kData = 0x10, kStatus1 = 0x14, kStatus2 = 0x18,
                                 kClock = 0x1C, kRise = 0x20;
  static constexpr std::uint32_t kOn = 1U << 0, kStart = 1U << 8, kStop = 1U << 9, kAcknowledge = 1U << 10,
                                 kReset = 1U << 15;
  static constexpr std::uint32_t kErrors = 7U << 8;  // of the bus, arbitration lost, not acknowledged
  static constexpr std::uint32_t kStarted = 1U << 0, kAddressed = 1U << 1, kFinished = 1U << 2, kCame = 1U << 6;
  static constexpr std::uint32_t kAddress = 0x36, kStatusRegister = 0x0B, kMagnetIsThere = 1U << 5;
  // Steps without progress: 5 ms.
  static constexpr std::uint32_t kMostSteps = 200;

  // What is waited for.
  enum class Phase : std::uint8_t { start, address, pointer, restart, read_address, first, second, third };

  static void set_up_bus() {
    hardware(i2c + kControl1) = kReset;
    hardware(i2c + kControl1) = 0;
    hardware(i2c + kControl2) = bus_hz / 1'000'000;
    // Fast mode, low twice as long as high; 300 ns of rise.
    hardware(i2c + kClock) = (1U << 15) | ((bus_hz + 1'199'999) / 1'200'000);
    hardware(i2c + kRise) = bus_hz / 1'000'000 * 3 / 10 + 1;
    hardware(i2c + kControl1) = kOn;
    hardware(i2c + kControl1) = kOn | kStart;
  }
  void step() {
    const std::uint32_t status = hardware(i2c + kStatus1);
    if ((status & kErrors) != 0 || (!advance(status) && ++idle_ > kMostSteps)) {
      set_up_bus();
      phase_ = Phase::start;
      idle_ = 0;
    }
  }
  bool go(Phase next) {
    phase_ = next;
    idle_ = 0;
    return true;
  }
  bool advance(std::uint32_t status) {
    switch (phase_) {
      case Phase::start:
        if ((status & kStarted) == 0) return false;
        hardware(i2c + kData) = kAddress << 1;
        return go(Phase::address);
      case Phase::address:
        if ((status & kAddressed) == 0) return false;
        clear_addressed();
        hardware(i2c + kData) = kStatusRegister;
        return go(Phase::pointer);
      case Phase::pointer:
        if ((status & kFinished) == 0) return false;
        hardware(i2c + kControl1) = kOn | kStart | kAcknowledge;
        return go(Phase::restart);
      case Phase::restart:
        if ((status & kStarted) == 0) return false;
        hardware(i2c + kData) = (kAddress << 1) | 1;
        return go(Phase::read_address);
      case Phase::read_address:
        if ((status & kAddressed) == 0) return false;
        clear_addressed();
        return go(Phase::first);
      // Three bytes: status and the angle, its high byte first. The end is prepared while the bus waits with two of
      // them received (27.3.3, closing the communication).
      case Phase::first:
        if ((status & kFinished) == 0) return false;
        hardware(i2c + kControl1) = kOn;  // the third is not acknowledged
        bytes_[0] = hardware(i2c + kData) & 0xFF;
        return go(Phase::second);
      case Phase::second:
        if ((status & kFinished) == 0) return false;
        hardware(i2c + kControl1) = kOn | kStop;
        bytes_[1] = hardware(i2c + kData) & 0xFF;
        return go(Phase::third);
      case Phase::third:
        if ((status & kCame) == 0 || (hardware(i2c + kControl1) & kStop) != 0) return false;
        bytes_[2] = hardware(i2c + kData) & 0xFF;
        finish();
        hardware(i2c + kControl1) = kOn | kStart;
        return go(Phase::start);
    }
    return false;
  }
  // The status was read before.
  static void clear_addressed() { [[maybe_unused]] const std::uint32_t read = hardware(i2c + kStatus2); }
  void finish() {
    if ((bytes_[0] & kMagnetIsThere) == 0) return;
    angle_.add(((bytes_[1] << 8) | bytes_[2]) % kCounts);
    fresh_ = true;
  }

  UnwrappedAngle<kCounts> angle_{};
  std::uint32_t bytes_[3]{};
  std::uint32_t idle_ = 0;
  Phase phase_ = Phase::start;
  bool fresh_ = false;
};

}  // namespace flexspline::stm32f4
