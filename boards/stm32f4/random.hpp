// The generator of random numbers of an STM32F405 (RM0090, 24). The F446 has none. Every wait is bounded.
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"
#include "firmware/board.hpp"

namespace flexspline::stm32f4 {

// Needs the clock of 48 MHz that USB needs.
class RandomNumbers {
 public:
  // Zeros for words that did not come, or that came while the generator reported an error of clock or seed.
  static firmware::RandomWords take() {
    switch_clock_on(kRng);
    set_bits(kRng, kOn);
    firmware::RandomWords words{};
    // 24.3.1: the first number after the start is not used, only compared with the next.
    std::uint32_t before = next();
    for (std::uint32_t& word : words) {
      word = next();
      if (word == before) word = 0;
      before = word;
    }
    clear_bits(kRng, kOn);
    return words;
  }

 private:
  static constexpr std::uint32_t kStatus = kRng + 0x04, kData = kRng + 0x08;
  static constexpr std::uint32_t kOn = 1U << 2, kReady = 1U << 0, kErrors = 3U << 1;
  // 40 periods of 48 MHz a number.
  static constexpr std::uint32_t kTries = 10'000;

  static std::uint32_t next() {
    if (!wait_for(kStatus, kReady, kReady, kTries) || (hardware(kStatus) & kErrors) != 0) return 0;
    return hardware(kData);
  }
};

}  // namespace flexspline::stm32f4
