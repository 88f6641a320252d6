// Description of this board: clock, pins, timers, amplifier. README.md has the pins as a table.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "boards/stm32f4/board.hpp"

namespace flexspline::nucleo_f446re {

using stm32f4::Pin, stm32f4::PinMode, stm32f4::Pull;

inline constexpr Pin kEnable{'C', 8, PinMode::output, 0, Pull::down};

struct Description {
  static constexpr std::string_view kName = "nucleo_f446re";
  // Current sensor and amplifier are those of the servo amplifier that is connected: set its full scales and its
  // largest current here. No block can override them.
  static constexpr control::Hardware kHardware{.motor_encoder = control::SensorKind::incremental,
                                               .output_encoder = control::SensorKind::incremental};
  // 8 MHz come from the programmer on the board, not from a crystal.
  static constexpr stm32f4::ClockSetup kClock{.crystal_hz = 8'000'000, .bypass = true, .core_hz = 160'000'000};
  static constexpr std::array kPins{
      kEnable,
      Pin{'A', 0, PinMode::alternate, 1, Pull::up},  // TIM2_CH1, motor encoder A
      Pin{'A', 1, PinMode::alternate, 1, Pull::up},  // TIM2_CH2, motor encoder B
      Pin{'C', 6, PinMode::alternate, 2, Pull::up},  // TIM3_CH1, output encoder A
      Pin{'C', 7, PinMode::alternate, 2, Pull::up},  // TIM3_CH2, output encoder B
      Pin{'C', 0, PinMode::analog},                  // ADC1_IN10, current
      Pin{'C', 1, PinMode::analog},                  // ADC1_IN11, torque
      Pin{'B', 0, PinMode::analog},                  // ADC1_IN8, temperature
      Pin{'A', 4, PinMode::analog},                  // DAC_OUT1, current command
      Pin{'A', 2, PinMode::alternate, 7},            // USART2_TX, to the programmer's serial port
      Pin{'A', 3, PinMode::alternate, 7, Pull::up},  // USART2_RX
  };
  static constexpr stm32f4::AnalogInputs kAnalog{.current = 10, .torque = 11, .temperature = 8};
  using MotorEncoder = stm32f4::Encoder<stm32f4::kTim2, stm32f4::CounterBits::thirty_two>;
  using OutputEncoder = stm32f4::Encoder<stm32f4::kTim3, stm32f4::CounterBits::sixteen>;
  static constexpr bool kMotorReversed = false, kOutputReversed = false;
  using Amplifier = stm32f4::ServoAmplifier<kEnable>;
  using Serial = stm32f4::Usart<stm32f4::kUsart2>;
  static constexpr std::uint32_t kBaud = 115'200;
  static constexpr bool kHasUsb = false;
  static constexpr std::uint32_t kParameterSector = 5;  // and the one after it, 128 KB each
  static constexpr std::uint32_t kPairingSector = 7;
};

}  // namespace flexspline::nucleo_f446re
