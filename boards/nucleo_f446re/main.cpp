// The application on a Nucleo-F446RE.
#include "boards/nucleo_f446re/board.hpp"
#include "boards/stm32f4/drive.hpp"

namespace {
constinit flexspline::stm32f4::Drive<flexspline::nucleo_f446re::Description> drive;
}  // namespace

extern "C" void TIM1_CC_IRQHandler() {
  drive.tick();
}
extern "C" void cut_amplifier() {
  flexspline::nucleo_f446re::Description::Amplifier::cut();
}
int main() {
  drive.run();
}
