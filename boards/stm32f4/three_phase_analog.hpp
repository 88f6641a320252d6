// Phase currents, bus voltage and temperature of a three-phase stage: injected conversions of two or three converters
// at once, which TIM1's trigger starts (RM0090, 13.9.1). The currents are first, all at the same instant; bus and
// temperature follow. The end of the first converter's conversions is the interrupt of the current loop.
#pragma once

#include <array>
#include <cstdint>

#include "boards/stm32f4/analog.hpp"
#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

struct ThreePhaseInputs {
  std::array<std::uint8_t, 3> currents{};  // of the phases a, b, c; of converters 1, 2, 3
  bool two_currents = false;               // phase c has no sensor
  std::uint8_t bus = 0;                    // of converter 1
  std::uint8_t temperature = 0;            // of converter 2
  bool currents_fall = false;              // their voltages fall with a current out of the leg
};

class ThreePhaseAnalog {
 public:
  static constexpr std::uint32_t kInterrupt = 18;
  // 15 cycles to sample and 12 to convert, at an eighth of the core's clock.
  static constexpr std::uint32_t kSampleCycles = 15 * 8;

  // Conversions begin with TIM1.
  static void start(const ThreePhaseInputs& inputs) {
    switch_clock_on(kAdc1);
    switch_clock_on(kAdc2);
    if (!inputs.two_currents) switch_clock_on(kAdc3);
    // A quarter of APB2; injected conversions of two, or of all three, start with those of the first.
    hardware(kAdcCommon + 0x04) = (1U << 16) | (inputs.two_currents ? 0x05U : 0x15U);
    set_up(kAdc1, inputs.currents[0], inputs.bus);
    set_up(kAdc2, inputs.currents[1], inputs.temperature);
    if (!inputs.two_currents) set_up(kAdc3, inputs.currents[2], inputs.currents[2]);
    cortex_m4::spend_cycles(1'000);  // 3 us until they are stable
    hardware(kAdc1 + kControl1) = kScan | kEndInterrupt;
    hardware(kAdc1 + kStatus) = 0;
    // At the rising edge of TIM1's trigger.
    hardware(kAdc1 + kControl2) = kOn | (1U << 16) | (1U << 20);
    cortex_m4::enable_interrupt(kInterrupt);
  }
  static void take() { hardware(kAdc1 + kStatus) = ~kInjectedEnd; }
  // `number`: 0 the current, 1 what follows.
  static std::uint32_t result(std::uint32_t converter, std::uint32_t number) {
    return hardware(converter + 0x3C + 4 * number) & 0xFFF;
  }

 private:
  static constexpr std::uint32_t kStatus = 0x00, kControl1 = 0x04, kControl2 = 0x08, kSampleTime = 0x0C,
                                 kSequence = 0x38;
  static constexpr std::uint32_t kInjectedEnd = 1U << 2, kEndInterrupt = 1U << 7, kScan = 1U << 8, kOn = 1U << 0;

  static void set_up(std::uint32_t converter, std::uint32_t first, std::uint32_t second) {
    hardware(converter + kSequence) = (1U << 20) | (first << 10) | (second << 15);
    for (const std::uint32_t input : {first, second}) {
      const std::uint32_t shift = 3 * (input % 10);
      change_bits(converter + kSampleTime + (input < 10 ? 4U : 0U), 7U << shift, 1U << shift);
    }
    hardware(converter + kControl1) = kScan;
    hardware(converter + kControl2) = kOn;
  }
};

}  // namespace flexspline::stm32f4
