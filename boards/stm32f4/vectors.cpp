// The vector table up to the one interrupt that is ever enabled, and what happens at an exception that has no business
// here: the amplifier off, then a reset. A stack that overflowed leaves the RAM at its lower end and ends here as well.
#include <cstdint>

#include "boards/cortex_m4/hardware.hpp"
#include "boards/stm32f4/handover.hpp"

extern "C" {
extern std::uint32_t stack_top[];
[[noreturn]] void Reset_Handler();
[[noreturn]] void Unexpected_Handler();
void ADC_IRQHandler();
// Of the boot loader alone.
[[gnu::weak]] void SysTick_Handler() {
  Unexpected_Handler();
}
// Of the board: opens all switches with nothing but registers.
void cut_amplifier();

[[noreturn, gnu::used, gnu::noinline]] void give_up() {
  cut_amplifier();
  flexspline::stm32f4::note_crash();
  flexspline::cortex_m4::reset_processor();
}
// The stack may be what went wrong: a new one first.
[[noreturn, gnu::naked, gnu::used]] void Unexpected_Handler() {
  asm volatile("ldr r0, =stack_top \n mov sp, r0 \n b give_up");
}
}

namespace {
union Vector {
  std::uint32_t* stack;
  void (*handler)();
};
constexpr Vector kGiveUp{.handler = Unexpected_Handler};
constexpr Vector kNone{.handler = nullptr};
constexpr Vector kSysTick{.handler = SysTick_Handler};
constexpr Vector kTick{.handler = ADC_IRQHandler};
// NMI is the crystal's death (RM0090, 7.2.7): the start after the reset takes the internal oscillator.
[[gnu::section(".vectors"), gnu::used]] const Vector kVectors[16 + 19] = {
    {.stack = stack_top},
    {.handler = Reset_Handler},
    // NMI to usage fault
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kNone,
    kNone,
    kNone,
    kNone,
    // SVCall, debug monitor, PendSV, SysTick
    kGiveUp,
    kGiveUp,
    kNone,
    kGiveUp,
    kSysTick,
    // interrupts 0 to 18
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kGiveUp,
    kTick,
};
}  // namespace
