// The boot loader on an STM32F405.
#include "boards/stm32f4/loader.hpp"
#include "boards/stm32f405/board.hpp"

namespace {
constinit flexspline::stm32f4::Loader<flexspline::stm32f405::Description> loader;
}  // namespace

extern "C" void SysTick_Handler() {
  loader.tick();
}
extern "C" void TIM1_CC_IRQHandler() {}
extern "C" void cut_amplifier() {
  flexspline::stm32f405::Description::Amplifier::cut();
}
int main() {
  loader.run();
}
