// What every Cortex-M4 has (ARMv7-M Architecture Reference Manual), as far as the boards use it, and how registers are
// reached.
#pragma once

#include <cstdint>

namespace flexspline::cortex_m4 {

// A register, by its address.
inline volatile std::uint32_t& hardware(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(static_cast<std::uintptr_t>(address));
}
inline void set_bits(std::uint32_t address, std::uint32_t bits) {
  hardware(address) = hardware(address) | bits;
}
inline void clear_bits(std::uint32_t address, std::uint32_t bits) {
  hardware(address) = hardware(address) & ~bits;
}
inline void change_bits(std::uint32_t address, std::uint32_t field, std::uint32_t value) {
  hardware(address) = (hardware(address) & ~field) | value;
}
// Waits until these bits of a register have the given value. The number of tries is limited: dead hardware must not
// hang a drive.
inline bool wait_for(std::uint32_t address, std::uint32_t field, std::uint32_t value, std::uint32_t tries) {
  for (; tries > 0; --tries)
    if ((hardware(address) & field) == value) return true;
  return false;
}
// At least so many cycles of the core.
inline void spend_cycles(std::uint32_t cycles) {
  for (std::uint32_t turn = 0; turn < cycles / 3; ++turn) asm volatile("nop");
}

inline constexpr std::uint32_t kInterruptEnable = 0xE000E100;  // NVIC_ISER0: 32 interrupts to a word
inline constexpr std::uint32_t kVectorTable = 0xE000ED08;      // SCB_VTOR
inline constexpr std::uint32_t kResetControl = 0xE000ED0C;     // SCB_AIRCR

inline void enable_interrupt(std::uint32_t number) {
  hardware(kInterruptEnable + 4 * (number / 32)) = std::uint32_t{1} << (number % 32);
}

// A tick that is requested by another interrupt: PendSV, with the lowest priority, so that all others interrupt it. It
// is one level only: interrupts that are never given a priority have the highest.
inline constexpr std::uint32_t kInterruptControl = 0xE000ED04;  // SCB_ICSR
inline constexpr std::uint32_t kSystemPriorities = 0xE000ED20;  // SCB_SHPR3
inline void set_tick_priority() {
  change_bits(kSystemPriorities, 0xFFU << 16, 0xFFU << 16);
}
inline void request_tick() {
  hardware(kInterruptControl) = 1U << 28;
}
inline bool tick_is_requested() {
  return (hardware(kInterruptControl) >> 28 & 1) != 0;
}

[[noreturn]] inline void reset_processor() {
  asm volatile("dsb" ::: "memory");
  hardware(kResetControl) = 0x05FA0004;  // key, SYSRESETREQ
  for (;;) asm volatile("nop");
}

}  // namespace flexspline::cortex_m4
