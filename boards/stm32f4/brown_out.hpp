// The supply below which the chip holds itself in reset: option bytes (RM0090, 3.6.2 and 5.2.2). As delivered that is
// off, and a processor whose supply sinks slowly may write flash memory wrongly. Level 3, about 2.7 V, is what writing
// words needs.
#pragma once

#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

// Sets it once for the life of the chip; all other option bytes stay as they are. It acts from the next reset on.
// False: the memory did not take it, as with read-out protection of level 2; the drive works, and the next start tries
// again.
inline bool set_brown_out_level() {
  constexpr std::uint32_t kKey = kFlash + 0x08, kStatus = kFlash + 0x0C, kOptions = kFlash + 0x14;
  constexpr std::uint32_t kLock = 1U << 0, kStart = 1U << 1, kLevel = 3U << 2, kLevel3 = 0, kBusy = 1U << 16;
  constexpr std::uint32_t kTries = 10'000'000;  // a second or more
  if ((hardware(kOptions) & kLevel) == kLevel3) return true;
  if (!wait_for(kStatus, kBusy, 0, kTries)) return false;
  hardware(kKey) = 0x08192A3B;
  hardware(kKey) = 0x4C5D6E7F;
  change_bits(kOptions, kLevel | kLock, kLevel3);
  set_bits(kOptions, kStart);
  const bool ended = wait_for(kStatus, kBusy, 0, kTries);
  set_bits(kOptions, kLock);
  return ended && (hardware(kOptions) & kLevel) == kLevel3;
}

}  // namespace flexspline::stm32f4
