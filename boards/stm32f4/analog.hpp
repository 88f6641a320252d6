// Current, torque and temperature: three injected conversions of ADC1, started by TIM1 at each of its periods and ended
// before the control tick, which TIM1 starts as well: a converter that hangs does not stop it (RM0090, 13).
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

// Converter inputs. Current and torque swing about half the supply, temperature begins at zero.
struct AnalogInputs {
  std::uint8_t current;
  std::uint8_t torque;
  std::uint8_t temperature;
  bool current_falls = false;  // the sensor's voltage falls with positive current
  bool torque_falls = false;
};

// 12 bits to shares of full scale, 2^-15. The ends of the range stay the ends, so that a broken wire is detected.
constexpr std::int16_t bipolar_share(std::uint32_t raw, bool falls) {
  const auto all = static_cast<std::int32_t>((raw << 4) | (raw >> 8)) - 32768;
  return static_cast<std::int16_t>(falls ? -1 - all : all);
}
constexpr std::int16_t unipolar_share(std::uint32_t raw) {
  return raw == 0 ? std::int16_t{-32768} : static_cast<std::int16_t>((raw << 3) | (raw >> 9));
}
static_assert(bipolar_share(0, false) == -32768 && bipolar_share(4095, false) == 32767 &&
              bipolar_share(2048, false) == 8 && bipolar_share(4095, true) == -32768);
static_assert(unipolar_share(4095) == 32767 && unipolar_share(1) == 8);

class Analog {
 public:
  // Conversions begin with TIM1.
  static void start(const AnalogInputs& inputs) {
    switch_clock_on(kAdc1);
    // A quarter of APB2: 21 MHz at 84 (at most 36).
    hardware(kAdcCommon + 0x04) = 1U << 16;
    hardware(kAdc1 + kSequence) = (2U << 20) | (std::uint32_t{inputs.current} << 5) |
                                  (std::uint32_t{inputs.torque} << 10) | (std::uint32_t{inputs.temperature} << 15);
    for (const std::uint8_t input : {inputs.current, inputs.torque, inputs.temperature}) set_sample_time(input);
    hardware(kAdc1 + kControl1) = kScan;
    hardware(kAdc1 + kControl2) = kOn;
    cortex_m4::spend_cycles(1'000);  // 3 us until it is stable
    hardware(kAdc1 + kStatus) = 0;
    // The current first, nearest to the middle of the period: at the rising edge of TIM1's trigger.
    hardware(kAdc1 + kControl2) = kOn | (1U << 16) | (1U << 20);
  }
  // A set of three samples is available. Taking it clears the flag.
  static bool ended() { return (hardware(kAdc1 + kStatus) & kInjectedEnd) != 0; }
  static void take() { hardware(kAdc1 + kStatus) = ~kInjectedEnd; }
  static std::uint32_t result(std::uint32_t number) { return hardware(kAdc1 + 0x3C + 4 * number) & 0xFFF; }

 private:
  static constexpr std::uint32_t kStatus = 0x00, kControl1 = 0x04, kControl2 = 0x08, kSampleTime = 0x0C,
                                 kSequence = 0x38;
  static constexpr std::uint32_t kInjectedEnd = 1U << 2, kScan = 1U << 8, kOn = 1U << 0;

  // 28 cycles to sample and 12 to convert: three inputs in 5.7 us, for a source of up to 10 kOhm.
  static void set_sample_time(std::uint32_t input) {
    const std::uint32_t at = kAdc1 + kSampleTime + (input < 10 ? 4U : 0U);
    const std::uint32_t shift = 3 * (input % 10);
    change_bits(at, 7U << shift, 2U << shift);
  }
};

}  // namespace flexspline::stm32f4
