// Quadrature encoders on timers: every edge of both tracks counts (RM0090, 18.3.12).
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

enum class CounterBits : std::uint8_t { sixteen, thirty_two };

// The count of a 16-bit timer is extended to 32 bits: it must be read before it has moved by half its range, so each
// tick.
template <std::uint32_t timer, CounterBits bits>
class Encoder {
 public:
  void start(bool reversed) {
    switch_clock_on(timer);
    // Both inputs, an edge counts after eight equal samples of the timer's clock.
    hardware(timer + kCapture) = (1U << 0) | (3U << 4) | (1U << 8) | (3U << 12);
    hardware(timer + kPolarity) = reversed ? 1U << 1 : 0U;  // the first input inverted: it counts the other way
    hardware(timer + kSlave) = 3;                           // encoder mode 3
    hardware(timer + kReload) = bits == CounterBits::sixteen ? 0xFFFF : 0xFFFFFFFF;
    hardware(timer + kCount) = 0;
    hardware(timer) = 1;
  }
  std::uint32_t count() {
    const std::uint32_t now = hardware(timer + kCount);
    if constexpr (bits == CounterBits::thirty_two) return now;
    const auto moved = static_cast<std::int16_t>(static_cast<std::uint16_t>(now - total_));
    return total_ += static_cast<std::uint32_t>(std::int32_t{moved});
  }

 private:
  static constexpr std::uint32_t kSlave = 0x08, kCapture = 0x18, kPolarity = 0x20, kCount = 0x24, kReload = 0x2C;

  std::uint32_t total_ = 0;
};

}  // namespace flexspline::stm32f4
