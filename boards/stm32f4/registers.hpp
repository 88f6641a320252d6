// Addresses of the peripherals of an STM32F405 and F446 (RM0090 and RM0390, memory map), and how each one's clock is
// switched on. Only those that are used; the registers of each are in its driver.
#pragma once

#include <cstdint>

#include "boards/cortex_m4/hardware.hpp"

namespace flexspline::stm32f4 {

using cortex_m4::change_bits;
using cortex_m4::clear_bits;
using cortex_m4::hardware;
using cortex_m4::set_bits;
using cortex_m4::wait_for;

inline constexpr std::uint32_t kTim1 = 0x40010000, kTim2 = 0x40000000, kTim3 = 0x40000400, kTim4 = 0x40000800,
                               kTim5 = 0x40000C00, kIwdg = 0x40003000, kUsart2 = 0x40004400, kUsart3 = 0x40004800,
                               kI2c1 = 0x40005400, kSpi1 = 0x40013000, kSpi3 = 0x40003C00, kPower = 0x40007000,
                               kDac = 0x40007400, kAdc1 = 0x40012000, kAdc2 = 0x40012100, kAdc3 = 0x40012200,
                               kAdcCommon = 0x40012300, kGpioA = 0x40020000, kGpioBytes = 0x400, kRcc = 0x40023800,
                               kFlash = 0x40023C00, kOtgFs = 0x50000000, kRng = 0x50060800;

// The chip's unique number of 96 bits (RM0090, 39.1).
inline constexpr std::uint32_t kUniqueId = 0x1FFF7A10;

// RCC_AHB1ENR and so on: the register that holds a clock's bit, and the bit.
struct ClockGate {
  std::uint32_t offset;
  std::uint32_t bit;
};
constexpr ClockGate gate_of(std::uint32_t peripheral) {
  switch (peripheral) {
    case kTim1:
      return {0x44, 1U << 0};
    case kTim2:
      return {0x40, 1U << 0};
    case kTim3:
      return {0x40, 1U << 1};
    case kTim4:
      return {0x40, 1U << 2};
    case kTim5:
      return {0x40, 1U << 3};
    case kUsart2:
      return {0x40, 1U << 17};
    case kUsart3:
      return {0x40, 1U << 18};
    case kI2c1:
      return {0x40, 1U << 21};
    case kSpi1:
      return {0x44, 1U << 12};
    case kSpi3:
      return {0x40, 1U << 15};
    case kPower:
      return {0x40, 1U << 28};
    case kDac:
      return {0x40, 1U << 29};
    case kAdc1:
      return {0x44, 1U << 8};
    case kAdc2:
      return {0x44, 1U << 9};
    case kAdc3:
      return {0x44, 1U << 10};
    case kOtgFs:
      return {0x34, 1U << 7};
    case kRng:
      return {0x34, 1U << 6};
    default:  // ports A to H
      return {0x30, 1U << ((peripheral - kGpioA) / kGpioBytes)};
  }
}
// RM0090, 7.2.14: two cycles of the bus pass before the peripheral answers; reading back takes them.
inline void switch_clock_on(std::uint32_t peripheral) {
  const ClockGate gate = gate_of(peripheral);
  set_bits(kRcc + gate.offset, gate.bit);
  [[maybe_unused]] const std::uint32_t on = hardware(kRcc + gate.offset);
}

}  // namespace flexspline::stm32f4
