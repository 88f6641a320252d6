// Description of this board: clock, pins, timers, amplifier. README.md has the pins as a table.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "boards/stm32f4/board.hpp"
#include "boards/stm32f4/i2c_encoder.hpp"
#include "boards/stm32f4/random.hpp"
#include "boards/stm32f4/spi_encoder.hpp"

namespace flexspline::stm32f405 {

using stm32f4::Pin, stm32f4::PinMode, stm32f4::Pull;

// Low: the amplifier is off. A resistor on the board pulls it down as well until the first instruction runs.
inline constexpr Pin kEnable{'C', 6, PinMode::output, 0, Pull::down};

// The encoders: quadrature (the default), the same with an index pulse of the motor's (FLEXSPLINE_INDEXED), or magnetic
// ones that know their angle, AS5047 of the motor and AS5600 of the output (FLEXSPLINE_ABSOLUTE).
#if defined(FLEXSPLINE_ABSOLUTE)
inline constexpr auto kMotorKind = control::SensorKind::absolute, kOutputKind = control::SensorKind::absolute;
inline constexpr Pin kMotorSelect{'C', 4, PinMode::output};
#elif defined(FLEXSPLINE_INDEXED)
inline constexpr auto kMotorKind = control::SensorKind::indexed, kOutputKind = control::SensorKind::incremental;
#else
inline constexpr auto kMotorKind = control::SensorKind::incremental, kOutputKind = control::SensorKind::incremental;
#endif

#ifdef FLEXSPLINE_PWM
// The board's current sensor, bridge and largest current. Torque sensor and thermometer are not part of the board, so
// the block states their scales.
inline constexpr control::Hardware kStated{.current_full_scale_ma = 8'000,
                                           .amplifier_full_scale_ma = 5'000,
                                           .most_current_ma = 5'000,
                                           .motor_encoder = kMotorKind,
                                           .output_encoder = kOutputKind};
// To be set for the motor and the supply, README.md says how. These are for 0.25 mH and 0.5 ohm, 5 A, 24 V, corner 6280
// rad/s.
inline constexpr stm32f4::BridgeSetup kBridge{
    .dead_time_cycles = 84,  // 500 ns
    .most_duty_percent = 94,
    .loop = {.proportional = 84, .integral = 2143, .limit = 30'800},
    .sensor_over_amplifier_q12 =
        static_cast<std::int32_t>(kStated.current_full_scale_ma * 4096 / kStated.amplifier_full_scale_ma)};
#else
// Current sensor and amplifier are those of the servo amplifier that is connected: set its full scales and its largest
// current here. No block can override them.
inline constexpr control::Hardware kStated{.motor_encoder = kMotorKind, .output_encoder = kOutputKind};
#endif

struct Description {
  // An image for the other amplifier, or for other encoders, is refused.
#if defined(FLEXSPLINE_ABSOLUTE) && defined(FLEXSPLINE_PWM)
  static constexpr std::string_view kName = "f405-pwm-abs";
#elif defined(FLEXSPLINE_ABSOLUTE)
  static constexpr std::string_view kName = "f405-dac-abs";
#elif defined(FLEXSPLINE_INDEXED) && defined(FLEXSPLINE_PWM)
  static constexpr std::string_view kName = "f405-pwm-index";
#elif defined(FLEXSPLINE_INDEXED)
  static constexpr std::string_view kName = "f405-dac-index";
#elif defined(FLEXSPLINE_PWM)
  static constexpr std::string_view kName = "stm32f405-pwm";
#else
  static constexpr std::string_view kName = "stm32f405-dac";
#endif
  static constexpr control::Hardware kHardware = kStated;
  static constexpr stm32f4::ClockSetup kClock{.crystal_hz = 8'000'000, .core_hz = 168'000'000};
  static constexpr std::array kPins{
      kEnable,
#ifdef FLEXSPLINE_ABSOLUTE
      kMotorSelect,                                        // of the AS5047
      Pin{'A', 5, PinMode::alternate, 5},                  // SPI1_SCK
      Pin{'A', 6, PinMode::alternate, 5, Pull::up},        // SPI1_MISO
      Pin{'A', 7, PinMode::alternate, 5},                  // SPI1_MOSI
      Pin{'B', 6, PinMode::alternate, 4, Pull::up, true},  // I2C1_SCL, of the AS5600
      Pin{'B', 7, PinMode::alternate, 4, Pull::up, true},  // I2C1_SDA
#else
      Pin{'A', 0, PinMode::alternate, 2, Pull::up},   // TIM5_CH1, output encoder A
      Pin{'A', 1, PinMode::alternate, 2, Pull::up},   // TIM5_CH2, output encoder B
      Pin{'A', 15, PinMode::alternate, 1, Pull::up},  // TIM2_CH1, motor encoder A
      Pin{'B', 3, PinMode::alternate, 1, Pull::up},   // TIM2_CH2, motor encoder B
#endif
#ifdef FLEXSPLINE_INDEXED
      Pin{'B', 10, PinMode::alternate, 1, Pull::down},  // TIM2_CH3, its index pulse
#endif
      Pin{'C', 0, PinMode::analog},                   // ADC1_IN10, current
      Pin{'C', 1, PinMode::analog},                   // ADC1_IN11, torque
      Pin{'C', 2, PinMode::analog},                   // ADC1_IN12, temperature
      Pin{'C', 10, PinMode::alternate, 7},            // USART3_TX
      Pin{'C', 11, PinMode::alternate, 7, Pull::up},  // USART3_RX
      Pin{'A', 9, PinMode::input},                    // OTG_FS_VBUS
      Pin{'A', 11, PinMode::alternate, 10},           // OTG_FS_DM
      Pin{'A', 12, PinMode::alternate, 10},           // OTG_FS_DP
#ifdef FLEXSPLINE_PWM
      Pin{'A', 8, PinMode::alternate, 1, Pull::down},   // TIM1_CH1, leg A high
      Pin{'B', 13, PinMode::alternate, 1, Pull::down},  // TIM1_CH1N, leg A low
      Pin{'A', 10, PinMode::alternate, 1, Pull::down},  // TIM1_CH3, leg B high
      Pin{'B', 15, PinMode::alternate, 1, Pull::down},  // TIM1_CH3N, leg B low
      Pin{'B', 12, PinMode::alternate, 1, Pull::up},    // TIM1_BKIN, low: the bridge reports a fault
#else
      Pin{'A', 4, PinMode::analog},                   // DAC_OUT1, current command
#endif
  };
  static constexpr stm32f4::AnalogInputs kAnalog{.current = 10, .torque = 11, .temperature = 12};
#if defined(FLEXSPLINE_ABSOLUTE)
  using MotorEncoder = stm32f4::As5047<stm32f4::kSpi1, kMotorSelect>;
  using OutputEncoder = stm32f4::As5600<stm32f4::kI2c1, kClock.core_hz / 4>;
#elif defined(FLEXSPLINE_INDEXED)
  using MotorEncoder = stm32f4::IndexedEncoder<stm32f4::kTim2>;
  using OutputEncoder = stm32f4::Encoder<stm32f4::kTim5, stm32f4::CounterBits::thirty_two>;
#else
  using MotorEncoder = stm32f4::Encoder<stm32f4::kTim2, stm32f4::CounterBits::thirty_two>;
  using OutputEncoder = stm32f4::Encoder<stm32f4::kTim5, stm32f4::CounterBits::thirty_two>;
#endif
  static constexpr bool kMotorReversed = false, kOutputReversed = false;
#ifdef FLEXSPLINE_PWM
  using Amplifier = stm32f4::HBridge<kEnable, kBridge>;
#else
  using Amplifier = stm32f4::ServoAmplifier<kEnable>;
#endif
  using Serial = stm32f4::Usart<stm32f4::kUsart3>;
  static constexpr std::uint32_t kBaud = 115'200;
  static constexpr bool kHasUsb = true;
  static constexpr std::uint32_t kParameterSector = 1;  // and the one after it
  static constexpr std::uint32_t kPairingSector = 4;
  using Random = stm32f4::RandomNumbers;
  static constexpr std::uint32_t kApplicationSector = 5;
  // Application, download and previous application, 96 KB each, and the security counter (application.ld).
  template <class Busy>
  using Images = stm32f4::ImageFlash<Busy, 0x18000, 5, 6, 7, 3>;
};

}  // namespace flexspline::stm32f405
