// A word of RAM that survives a reset of the processor: the application requests the boot loader, or notes that it
// crashed.
#pragma once

#include <cstdint>

namespace flexspline::stm32f4 {

inline constexpr std::uint32_t kLoaderWanted = 0x4C4F4144, kCrashed = 0x43525348;
// Defined by the linker script: the place of an inline variable of a named section is not fixed once two files use it.
extern "C" volatile std::uint32_t handover;

inline void request_loader() {
  handover = kLoaderWanted;
}
// Reading clears it.
inline bool is_noted(std::uint32_t note) {
  const bool noted = handover == note;
  if (noted) handover = 0;
  return noted;
}
inline bool loader_is_requested() {
  return is_noted(kLoaderWanted);
}
inline void note_crash() {
  handover = kCrashed;
}
inline bool crash_was_noted() {
  return is_noted(kCrashed);
}

}  // namespace flexspline::stm32f4
