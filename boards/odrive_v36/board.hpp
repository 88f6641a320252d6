// Description of this board, its axis M0: clock, pins, timers, half bridges. README.md has the pins as a table.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "boards/odrive_v36/stage.hpp"
#include "boards/stm32f4/brake_output.hpp"
#include "boards/stm32f4/drv8301.hpp"
#include "boards/stm32f4/random.hpp"
#include "boards/stm32f4/three_phase_board.hpp"

#ifndef FLEXSPLINE_ENCODER_COUNTS
#define FLEXSPLINE_ENCODER_COUNTS 8192
#endif

namespace flexspline::odrive_v36 {

using stm32f4::Pin, stm32f4::PinMode, stm32f4::Pull;

// The enable of both gate drivers; that of the other axis has its six inputs pulled down.
inline constexpr Pin kEnable{'B', 12, PinMode::output, 0, Pull::down};
inline constexpr Pin kFault{'D', 2, PinMode::input, 0, Pull::up};
inline constexpr Pin kSelect{'C', 13, PinMode::output};
inline constexpr std::uint32_t kCoreHz = 168'000'000;

// Overcurrent at 0.73 V of a switch that is on, about 150 A when it is hot; amplifiers of 40.
inline constexpr stm32f4::Drv8301Setup kDriver{.core_hz = kCoreHz,
                                               .control1 = stm32f4::drv8301_control1(21),
                                               .control2 = stm32f4::drv8301_control2(stm32f4::Drv8301Gain::forty)};
// The shunts are in legs B and C: they are the stage's phases a and b, and leg A is its phase c.
inline constexpr stm32f4::ThreePhaseBridgeSetup kBridge{.dead_time_cycles = 40,  // 240 ns; the driver has 50 of its own
                                                        .legs = {2, 3, 1},
                                                        // The sample is held in the middle of the low sides' time.
                                                        .sample_lead_cycles = stm32f4::ThreePhaseAnalog::kSampleCycles};

struct Description {
  static constexpr std::string_view kName = "odrive-v3.6-m0";
  // The temperature is that of the power stage.
  static constexpr control::Hardware kHardware{.current_full_scale_ma = kCurrentFullScaleMa,
                                               .amplifier_full_scale_ma = kMostCurrentMa,
                                               .most_current_ma = kMostCurrentMa,
                                               .temperature_full_scale_mc = 256'000,
                                               .motor_encoder = control::SensorKind::incremental,
                                               .output_encoder = control::SensorKind::incremental,
                                               .torque_sensor = control::SensorKind::none};
  static constexpr firmware::ThreePhaseSettings kStage = stage_settings(FLEXSPLINE_ENCODER_COUNTS);
  static constexpr firmware::StageParts kStageParts = kParts;
  static constexpr stm32f4::ClockSetup kClock{.crystal_hz = 8'000'000, .core_hz = kCoreHz};
  static constexpr std::array kPins{
      kEnable,
      kFault,
      kSelect,
      Pin{'C', 14, PinMode::input, 0, Pull::up},        // selection of the other axis' gate driver: never
      Pin{'A', 8, PinMode::alternate, 1, Pull::down},   // TIM1_CH1, leg A high
      Pin{'A', 9, PinMode::alternate, 1, Pull::down},   // TIM1_CH2, leg B high
      Pin{'A', 10, PinMode::alternate, 1, Pull::down},  // TIM1_CH3, leg C high
      Pin{'B', 13, PinMode::alternate, 1, Pull::down},  // TIM1_CH1N, leg A low
      Pin{'B', 14, PinMode::alternate, 1, Pull::down},  // TIM1_CH2N, leg B low
      Pin{'B', 15, PinMode::alternate, 1, Pull::down},  // TIM1_CH3N, leg C low
      Pin{'C', 6, PinMode::input, 0, Pull::down},       // the other axis: all its switches open
      Pin{'C', 7, PinMode::input, 0, Pull::down},
      Pin{'C', 8, PinMode::input, 0, Pull::down},
      Pin{'A', 7, PinMode::input, 0, Pull::down},
      Pin{'B', 0, PinMode::input, 0, Pull::down},
      Pin{'B', 1, PinMode::input, 0, Pull::down},
      Pin{'B', 10, PinMode::alternate, 1, Pull::down},  // TIM2_CH3, brake resistor low
      Pin{'B', 11, PinMode::alternate, 1, Pull::down},  // TIM2_CH4, brake resistor high
      Pin{'C', 10, PinMode::alternate, 6},              // SPI3_SCK, of the gate driver
      Pin{'C', 11, PinMode::alternate, 6, Pull::up},    // SPI3_MISO
      Pin{'C', 12, PinMode::alternate, 6},              // SPI3_MOSI
      Pin{'C', 0, PinMode::analog},                     // ADC1_IN10, current of leg B
      Pin{'C', 1, PinMode::analog},                     // ADC2_IN11, of leg C
      Pin{'A', 6, PinMode::analog},                     // ADC1_IN6, bus voltage
      Pin{'C', 5, PinMode::analog},                     // ADC2_IN15, temperature
      Pin{'B', 4, PinMode::alternate, 2, Pull::up},     // TIM3_CH1, motor encoder A (M0)
      Pin{'B', 5, PinMode::alternate, 2, Pull::up},     // TIM3_CH2, motor encoder B
      Pin{'B', 6, PinMode::alternate, 2, Pull::up},     // TIM4_CH1, output encoder A (M1)
      Pin{'B', 7, PinMode::alternate, 2, Pull::up},     // TIM4_CH2, output encoder B
      Pin{'A', 2, PinMode::alternate, 7},               // USART2_TX (GPIO3)
      Pin{'A', 3, PinMode::alternate, 7, Pull::up},     // USART2_RX (GPIO4)
      Pin{'A', 11, PinMode::alternate, 10},             // OTG_FS_DM
      Pin{'A', 12, PinMode::alternate, 10},             // OTG_FS_DP
  };
  static constexpr stm32f4::ThreePhaseInputs kAnalog{
      .currents = {10, 11, 0}, .two_currents = true, .bus = 6, .temperature = 15};
  using MotorEncoder = stm32f4::Encoder<stm32f4::kTim3, stm32f4::CounterBits::sixteen>;
  using OutputEncoder = stm32f4::Encoder<stm32f4::kTim4, stm32f4::CounterBits::sixteen>;
  static constexpr bool kMotorReversed = false, kOutputReversed = false;
  using Driver = stm32f4::Drv8301<stm32f4::kSpi3, kSelect, kEnable, kFault, kDriver>;
  using Bridge = stm32f4::ThreePhaseBridge<kBridge, Driver>;
  using Brake = stm32f4::BrakeOutput<stm32f4::kTim2, kCoreHz / 2, 20'000>;
  using Serial = stm32f4::Usart<stm32f4::kUsart2>;
  static constexpr std::uint32_t kBaud = 115'200;
  static constexpr bool kHasUsb = true;
  static constexpr bool kSensesUsbPower = false;        // PA9 drives a switch
  static constexpr std::uint32_t kParameterSector = 1;  // and the one after it
  static constexpr std::uint32_t kPairingSector = 4;
  using Random = stm32f4::RandomNumbers;
  static constexpr std::uint32_t kApplicationSector = 5;
  // Application, download and previous application, 120 KB each, and the security counter (application.ld).
  template <class Busy>
  using Images = stm32f4::ImageFlash<Busy, 0x1E000, 5, 6, 7, 3>;

  static void cut() {
    Bridge::cut();
    Brake::cut();
  }
};

}  // namespace flexspline::odrive_v36
