// The boot loader on an ODrive v3.6.
#include "boards/odrive_v36/board.hpp"
#include "boards/stm32f4/loader.hpp"

namespace {
constinit flexspline::stm32f4::Loader<flexspline::odrive_v36::Description> loader;
}  // namespace

extern "C" void SysTick_Handler() {
  loader.tick();
}
extern "C" void TIM1_CC_IRQHandler() {}
extern "C" void cut_amplifier() {
  flexspline::odrive_v36::Description::cut();
}
int main() {
  loader.run();
}
