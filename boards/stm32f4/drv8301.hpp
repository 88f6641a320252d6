// The gate driver DRV8301: its enable, its fault line and its registers over SPI (its data sheet, SLOS719, 7.5 and 7.6;
// RM0090, 28). A frame has 16 bits: read or write, four of an address, eleven of data; an answer comes with the next.
//
// It is set up once, before the PWM starts, and read back: what does not hold what was written counts as a fault, and
// the stage never switches on. Its registers are lost where the enable goes low, so the enable stays high; all switches
// are open while the timer's outputs are off.
#pragma once

#include <cstdint>

#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

struct Drv8301Setup {
  std::uint32_t core_hz = 0;
  std::uint16_t control1 = 0;
  std::uint16_t control2 = 0;
};
// Six inputs for six switches; a switch whose voltage passes the limit while it is on ends all until a reset.
constexpr std::uint16_t drv8301_control1(std::uint32_t overcurrent_level) {
  return static_cast<std::uint16_t>((overcurrent_level << 6) | (1U << 4));
}
enum class Drv8301Gain : std::uint8_t { ten, twenty, forty, eighty };
// Overtemperature and overcurrent show on its outputs.
constexpr std::uint16_t drv8301_control2(Drv8301Gain gain) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(gain) << 2);
}

template <std::uint32_t spi, const Pin& select, const Pin& enable, const Pin& fault, const Drv8301Setup& setup>
class Drv8301 {
 public:
  // Waits for it: it answers 10 ms after its enable.
  void start() {
    switch_clock_on(spi);
    write(select, true);
    hardware(spi + kControl) = 0;
    // Master, 16 bits, data at the second edge, a sixteenth of the bus: 2.6 MHz of at most 10.
    hardware(spi + kControl) = (1U << 11) | (3U << 8) | (3U << 3) | (1U << 2) | (1U << 0);
    set_bits(spi + kControl, kOn);
    write(enable, true);
    cortex_m4::spend_cycles(setup.core_hz / 100);
    for (int left = kTries; left > 0 && !ready_; --left) {
      exchange(word(kControl1, setup.control1));
      exchange(word(kControl2, setup.control2));
      ready_ = holds(kControl1, setup.control1) && holds(kControl2, setup.control2);
    }
  }
  bool is_ready() const { return ready_; }
  // Its fault line is low.
  static bool is_faulty() { return !reads_high(fault); }
  // Resets what it holds off, a half of a frame a call: called for some periods, while all switches are open.
  void clear() {
    begins_ = !begins_;
    if (!begins_) return finish_reset();
    write(select, false);
    cortex_m4::spend_cycles(kSelectCycles);
    hardware(spi + kData) = word(kControl1, setup.control1 | kReset);
  }
  static void cut() { write(enable, false); }

 private:
  static constexpr std::uint32_t kControl = 0x00, kStatus = 0x08, kData = 0x0C;
  static constexpr std::uint32_t kCame = 1U << 0, kOn = 1U << 6;
  static constexpr std::uint32_t kControl1 = 2, kControl2 = 3, kReset = 1U << 2, kRead = 1U << 15, kDataBits = 0x7FF;
  static constexpr int kTries = 5;
  static constexpr std::uint32_t kFrameTries = 10'000;
  // 50 ns from its selection to the first clock, 400 ns between two frames.
  static constexpr std::uint32_t kSelectCycles = 120;

  static constexpr std::uint32_t word(std::uint32_t address, std::uint32_t data) { return (address << 11) | data; }
  static std::uint32_t exchange(std::uint32_t frame) {
    write(select, false);
    cortex_m4::spend_cycles(kSelectCycles);
    hardware(spi + kData) = frame;
    const bool came = wait_for(spi + kStatus, kCame, kCame, kFrameTries);
    const std::uint32_t answer = came ? hardware(spi + kData) : kRead;
    write(select, true);
    cortex_m4::spend_cycles(kSelectCycles);
    return answer;
  }
  // The address comes back with the data; the highest bit says that the frame before was wrong.
  static bool holds(std::uint32_t address, std::uint32_t data) {
    exchange(kRead | word(address, 0));
    return exchange(kRead | word(address, 0)) == word(address, data);
  }
  static void finish_reset() {
    [[maybe_unused]] const std::uint32_t answer = hardware(spi + kData);
    write(select, true);
  }

  bool ready_ = false;
  bool begins_ = false;
};

}  // namespace flexspline::stm32f4
