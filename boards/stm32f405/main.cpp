// The application on an STM32F405.
#include "boards/stm32f4/drive.hpp"
#include "boards/stm32f405/board.hpp"

namespace {
constinit flexspline::stm32f4::Drive<flexspline::stm32f405::Description> drive;
}  // namespace

extern "C" void TIM1_CC_IRQHandler() {
  drive.tick();
}
extern "C" void cut_amplifier() {
  flexspline::stm32f405::Description::Amplifier::cut();
}
int main() {
  drive.run();
}
