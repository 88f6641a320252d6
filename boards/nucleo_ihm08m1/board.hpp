// Description of this board: clock, pins, timers, half bridges. README.md has the pins as a table.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "boards/nucleo_ihm08m1/stage.hpp"
#include "boards/stm32f4/i2c_encoder.hpp"
#include "boards/stm32f4/spi_encoder.hpp"
#include "boards/stm32f4/three_phase_board.hpp"

#ifndef FLEXSPLINE_ENCODER_COUNTS
#define FLEXSPLINE_ENCODER_COUNTS 4096
#endif

namespace flexspline::nucleo_ihm08m1 {

using stm32f4::Pin, stm32f4::PinMode, stm32f4::Pull;

inline constexpr stm32f4::ThreePhaseBridgeSetup kBridge{
    .dead_time_cycles = 80,  // 500 ns; the drivers have 320 of their own
    .low_sides_inverted = true,
    .has_break_input = true,
    // The sample is held in the middle of the low sides' time.
    .sample_lead_cycles = stm32f4::ThreePhaseAnalog::kSampleCycles};

inline constexpr Pin kMotorSelect{'D', 2, PinMode::output};

// The encoders: quadrature (the default), the same with an index pulse of the motor's (FLEXSPLINE_INDEXED), or magnetic
// ones that know their angle, AS5047 of the motor and AS5600 of the output (FLEXSPLINE_ABSOLUTE).
struct Description {
#if defined(FLEXSPLINE_ABSOLUTE)
  static constexpr std::string_view kName = "ihm08m1-abs";
  using MotorEncoder = stm32f4::As5047<stm32f4::kSpi3, kMotorSelect>;
  using OutputEncoder = stm32f4::As5600<stm32f4::kI2c1, 40'000'000>;
  static constexpr auto kMotorKind = control::SensorKind::absolute, kOutputKind = control::SensorKind::absolute;
  static constexpr std::uint32_t kCounts = MotorEncoder::kCounts;
#elif defined(FLEXSPLINE_INDEXED)
  static constexpr std::string_view kName = "ihm08m1-index";
  using MotorEncoder = stm32f4::IndexedEncoder<stm32f4::kTim2>;
  static constexpr auto kMotorKind = control::SensorKind::indexed;
#else
  static constexpr std::string_view kName = "ihm08m1";
  using MotorEncoder = stm32f4::Encoder<stm32f4::kTim2, stm32f4::CounterBits::thirty_two>;
  static constexpr auto kMotorKind = control::SensorKind::incremental;
#endif
#ifndef FLEXSPLINE_ABSOLUTE
  using OutputEncoder = stm32f4::Encoder<stm32f4::kTim3, stm32f4::CounterBits::sixteen>;
  static constexpr auto kOutputKind = control::SensorKind::incremental;
  static constexpr std::uint32_t kCounts = FLEXSPLINE_ENCODER_COUNTS;
#endif
  // The temperature is that of the power stage.
  static constexpr control::Hardware kHardware{.current_full_scale_ma = kCurrentFullScaleMa,
                                               .amplifier_full_scale_ma = kMostCurrentMa,
                                               .most_current_ma = kMostCurrentMa,
                                               .temperature_full_scale_mc = 256'000,
                                               .motor_encoder = kMotorKind,
                                               .output_encoder = kOutputKind,
                                               .torque_sensor = control::SensorKind::none};
  static constexpr firmware::ThreePhaseSettings kStage = stage_settings(kCounts);
  static constexpr firmware::StageParts kStageParts = kParts;
  // 8 MHz come from the programmer on the board, not from a crystal.
  static constexpr stm32f4::ClockSetup kClock{.crystal_hz = 8'000'000, .bypass = true, .core_hz = 160'000'000};
  static constexpr std::array kPins{
      // Before the timer drives them the pulls hold all switches open: a low side is on where its input is low.
      Pin{'A', 8, PinMode::alternate, 1, Pull::down},   // TIM1_CH1, phase a high
      Pin{'A', 9, PinMode::alternate, 1, Pull::down},   // TIM1_CH2, phase b high
      Pin{'A', 10, PinMode::alternate, 1, Pull::down},  // TIM1_CH3, phase c high
      Pin{'A', 7, PinMode::alternate, 1, Pull::up},     // TIM1_CH1N, phase a low
      Pin{'B', 0, PinMode::alternate, 1, Pull::up},     // TIM1_CH2N, phase b low
      Pin{'B', 1, PinMode::alternate, 1, Pull::up},     // TIM1_CH3N, phase c low
      Pin{'A', 6, PinMode::alternate, 1, Pull::up},     // TIM1_BKIN, low: overcurrent
      Pin{'A', 0, PinMode::analog},                     // ADC1_IN0, current of a
      Pin{'C', 1, PinMode::analog},                     // ADC2_IN11, of b
      Pin{'C', 0, PinMode::analog},                     // ADC3_IN10, of c
      Pin{'A', 1, PinMode::analog},                     // ADC1_IN1, bus voltage
      Pin{'C', 2, PinMode::analog},                     // ADC2_IN12, temperature
#ifdef FLEXSPLINE_ABSOLUTE
      kMotorSelect,                                        // of the AS5047
      Pin{'C', 10, PinMode::alternate, 6},                 // SPI3_SCK
      Pin{'C', 11, PinMode::alternate, 6, Pull::up},       // SPI3_MISO
      Pin{'C', 12, PinMode::alternate, 6},                 // SPI3_MOSI
      Pin{'B', 8, PinMode::alternate, 4, Pull::up, true},  // I2C1_SCL, of the AS5600
      Pin{'B', 9, PinMode::alternate, 4, Pull::up, true},  // I2C1_SDA
#else
      Pin{'A', 15, PinMode::alternate, 1, Pull::up},  // TIM2_CH1, motor encoder A
      Pin{'B', 3, PinMode::alternate, 1, Pull::up},   // TIM2_CH2, motor encoder B
      Pin{'C', 6, PinMode::alternate, 2, Pull::up},   // TIM3_CH1, output encoder A
      Pin{'C', 7, PinMode::alternate, 2, Pull::up},   // TIM3_CH2, output encoder B
#endif
#ifdef FLEXSPLINE_INDEXED
      Pin{'B', 10, PinMode::alternate, 1, Pull::down},  // TIM2_CH3, its index pulse
#endif
      Pin{'A', 2, PinMode::alternate, 7},            // USART2_TX, to the programmer's serial port
      Pin{'A', 3, PinMode::alternate, 7, Pull::up},  // USART2_RX
  };
  static constexpr stm32f4::ThreePhaseInputs kAnalog{
      .currents = {0, 11, 10}, .bus = 1, .temperature = 12, .currents_fall = true};
  static constexpr bool kMotorReversed = false, kOutputReversed = false;
  using Bridge = stm32f4::ThreePhaseBridge<kBridge, stm32f4::PlainDriver>;
  using Serial = stm32f4::Usart<stm32f4::kUsart2>;
  static constexpr std::uint32_t kBaud = 115'200;
  static constexpr bool kHasUsb = false;
  static constexpr std::uint32_t kParameterSector = 5;  // and the one after it, 128 KB each
  static constexpr std::uint32_t kPairingSector = 7;
};

}  // namespace flexspline::nucleo_ihm08m1
