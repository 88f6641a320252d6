// A word of RAM that outlasts a reset of the processor: the application asks for the boot loader.
#pragma once

#include <cstdint>

namespace flexspline::stm32f4 {

inline constexpr std::uint32_t kLoaderWanted = 0x4C4F4144;
[[gnu::section(".handover")]] inline volatile std::uint32_t handover;

inline void ask_for_loader() {
  handover = kLoaderWanted;
}
// Asking forgets it.
inline bool loader_is_wanted() {
  const bool wanted = handover == kLoaderWanted;
  handover = 0;
  return wanted;
}

}  // namespace flexspline::stm32f4
