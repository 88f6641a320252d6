// A word of RAM that outlasts a reset of the processor: the application asks for the boot loader, or notes that it gave
// up.
#pragma once

#include <cstdint>

namespace flexspline::stm32f4 {

inline constexpr std::uint32_t kLoaderWanted = 0x4C4F4144, kCrashed = 0x43525348;
// Of the linker script: where an inline variable of a named section ends up is the linker's choice once two files use
// it.
extern "C" volatile std::uint32_t handover;

inline void ask_for_loader() {
  handover = kLoaderWanted;
}
// Asking forgets it.
inline bool is_noted(std::uint32_t note) {
  const bool noted = handover == note;
  if (noted) handover = 0;
  return noted;
}
inline bool loader_is_wanted() {
  return is_noted(kLoaderWanted);
}
inline void note_crash() {
  handover = kCrashed;
}
inline bool crash_was_noted() {
  return is_noted(kCrashed);
}

}  // namespace flexspline::stm32f4
