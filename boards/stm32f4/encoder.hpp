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
    hardware(timer + kSlave) = kBothTracks;                 // encoder mode 3
    hardware(timer + kReload) = bits == CounterBits::sixteen ? 0xFFFF : 0xFFFFFFFF;
    hardware(timer + kCount) = 0;
    hardware(timer) = 1;
  }
  // False: the timer does not count the tracks any more.
  bool take(std::uint32_t& count) {
    const std::uint32_t now = hardware(timer + kCount);
    const auto moved = static_cast<std::int16_t>(static_cast<std::uint16_t>(now - total_));
    total_ = bits == CounterBits::thirty_two ? now : total_ + static_cast<std::uint32_t>(std::int32_t{moved});
    if ((hardware(timer) & 1) == 0 || (hardware(timer + kSlave) & 7) != kBothTracks) return false;
    count = total_;
    return true;
  }

 protected:
  static constexpr std::uint32_t kBothTracks = 3;
  static constexpr std::uint32_t kSlave = 0x08, kCapture = 0x18, kPolarity = 0x20, kCount = 0x24, kReload = 0x2C;

 private:
  std::uint32_t total_ = 0;
};

// The same with an index pulse at channel 3, whose rising edge keeps the count (18.3.5). Turning backward the rising
// edge is the other one of the pulse: it should be as short as a count.
template <std::uint32_t timer>
class IndexedEncoder : public Encoder<timer, CounterBits::thirty_two> {
  using Base = Encoder<timer, CounterBits::thirty_two>;

 public:
  void start(bool reversed) {
    Base::start(reversed);
    hardware(timer + kCapture34) = (1U << 0) | (3U << 4);
    set_bits(timer + Base::kPolarity, 1U << 8);
  }
  // False: there was no pulse since the last call.
  bool take_index(std::uint32_t& count) {
    constexpr std::uint32_t kCaptured = 1U << 3;
    if ((hardware(timer + kStatus) & kCaptured) == 0) return false;
    count = hardware(timer + kCaptured3);  // clears the flag
    return true;
  }

 private:
  static constexpr std::uint32_t kStatus = 0x10, kCapture34 = 0x1C, kCaptured3 = 0x3C;
};

}  // namespace flexspline::stm32f4
