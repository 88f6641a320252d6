// Pins, as a table of a board says (RM0090, 8).
#pragma once

#include <cstdint>
#include <span>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

enum class PinMode : std::uint8_t { input, output, alternate, analog };
enum class Pull : std::uint8_t { none, up, down };

struct Pin {
  char port;            // 'A' to 'H'
  std::uint8_t number;  // 0 to 15
  PinMode mode = PinMode::analog;
  std::uint8_t function = 0;  // of an alternate one
  Pull pull = Pull::none;
  bool open_drain = false;

  constexpr std::uint32_t base() const { return kGpioA + kGpioBytes * static_cast<std::uint32_t>(port - 'A'); }
};

// The pin of an input of ADC1 or ADC2; of ADC3 the same up to 3, and from 10 to 13 (data sheets, pin table).
constexpr Pin pin_of_analog_input(std::uint8_t input) {
  if (input < 8) return {'A', input};
  if (input < 10) return {'B', static_cast<std::uint8_t>(input - 8)};
  return {'C', static_cast<std::uint8_t>(input - 10)};
}
// Whether the pin of each of these inputs is set up as an analog one.
template <class... Input>
constexpr bool are_analog(std::span<const Pin> pins, Input... inputs) {
  const auto is_analog = [&](const Pin& wanted) {
    for (const Pin& p : pins)
      if (p.port == wanted.port && p.number == wanted.number) return p.mode == PinMode::analog;
    return false;
  };
  return (is_analog(pin_of_analog_input(inputs)) && ...);
}
static_assert(pin_of_analog_input(7).port == 'A' && pin_of_analog_input(9).number == 1 &&
              pin_of_analog_input(15).port == 'C' && pin_of_analog_input(15).number == 5);

inline void set_up(const Pin& p) {
  constexpr std::uint32_t kType = 0x04, kSpeed = 0x08, kPull = 0x0C, kFunction = 0x20;
  switch_clock_on(p.base());
  const std::uint32_t two = 2U * p.number, four = 4U * (p.number % 8);
  change_bits(p.base() + kType, 1U << p.number, (p.open_drain ? 1U : 0U) << p.number);
  change_bits(p.base() + kPull, 3U << two, static_cast<std::uint32_t>(p.pull) << two);
  // Fast edges where a timer or USB drives the pin.
  if (p.mode == PinMode::alternate) change_bits(p.base() + kSpeed, 3U << two, 2U << two);
  change_bits(p.base() + kFunction + 4U * (p.number / 8), 15U << four, std::uint32_t{p.function} << four);
  // The mode last: by then a pin of a peripheral has its function, an output its level.
  change_bits(p.base(), 3U << two, static_cast<std::uint32_t>(p.mode) << two);
}
inline void set_up(std::span<const Pin> pins) {
  for (const Pin& p : pins) set_up(p);
}
// One write, atomic (BSRR). The port's clock has to be on.
inline void write(const Pin& p, bool high) {
  hardware(p.base() + 0x18) = std::uint32_t{1} << (p.number + (high ? 0U : 16U));
}
inline bool reads_high(const Pin& p) {
  return (hardware(p.base() + 0x10) >> p.number & 1) != 0;
}

}  // namespace flexspline::stm32f4
