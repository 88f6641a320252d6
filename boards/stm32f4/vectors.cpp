// The vector table up to the last interrupt that is ever enabled, and the handler of unexpected exceptions: the
// amplifier off, then a reset. A stack overflow leaves the RAM at its lower end and ends here as well.
#include <cstdint>

#include "boards/cortex_m4/hardware.hpp"
#include "boards/stm32f4/handover.hpp"

extern "C" {
extern std::uint32_t stack_top[];
[[noreturn]] void Reset_Handler();
[[noreturn]] void Unexpected_Handler();
void TIM1_CC_IRQHandler();
// The boot loader only.
[[gnu::weak]] void SysTick_Handler() {
  Unexpected_Handler();
}
// Boards with three half bridges: the end of the conversions, and the tick.
[[gnu::weak]] void ADC_IRQHandler() {
  Unexpected_Handler();
}
[[gnu::weak]] void PendSV_Handler() {
  Unexpected_Handler();
}
// Provided by the board: opens all switches by writing registers only.
void cut_amplifier();

[[noreturn, gnu::used, gnu::noinline]] void switch_off_and_reset() {
  cut_amplifier();
  flexspline::stm32f4::note_crash();
  flexspline::cortex_m4::reset_processor();
}
// The stack may be the cause: set a new one first.
[[noreturn, gnu::naked, gnu::used]] void Unexpected_Handler() {
  asm volatile("ldr r0, =stack_top \n mov sp, r0 \n b switch_off_and_reset");
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
constexpr Vector kPendSv{.handler = PendSV_Handler};
constexpr Vector kConverters{.handler = ADC_IRQHandler};
constexpr Vector kTick{.handler = TIM1_CC_IRQHandler};
// NMI: the crystal failed (RM0090, 7.2.7). The start after the reset takes the internal oscillator.
[[gnu::section(".vectors"), gnu::used]] const Vector kVectors[16 + 28] = {
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
    kPendSv,
    kSysTick,
    // interrupts 0 to 27
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
    kConverters,
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
