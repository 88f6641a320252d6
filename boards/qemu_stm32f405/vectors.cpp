// The vector table, and the handler of unexpected exceptions. Start-up is boards/cortex_m4/start.cpp.
#include <cstdint>

#include "boards/qemu_stm32f405/semihosting.hpp"

extern "C" {
extern std::uint32_t stack_top[];
[[noreturn]] void Reset_Handler();
void SysTick_Handler();

[[noreturn]] void Unexpected_Handler() {
  flexspline::qemu::print("unexpected exception\n");
  flexspline::qemu::leave(3);
}
}

namespace {
union Vector {
  std::uint32_t* stack;
  void (*handler)();
};
// The system exceptions; none of the board's interrupts is ever enabled.
[[gnu::section(".vectors"), gnu::used]] const Vector kVectors[16] = {
    {.stack = stack_top},
    {.handler = Reset_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = nullptr},
    {.handler = Unexpected_Handler},
    {.handler = SysTick_Handler},
};
}  // namespace
