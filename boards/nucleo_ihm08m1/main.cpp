// The application on a Nucleo-F446RE with an X-NUCLEO-IHM08M1.
#include "boards/nucleo_ihm08m1/board.hpp"
#include "boards/stm32f4/drive.hpp"

namespace {
constinit flexspline::stm32f4::Drive<flexspline::nucleo_ihm08m1::Description> drive;
}  // namespace

extern "C" void ADC_IRQHandler() {
  drive.period();
}
extern "C" void TIM1_CC_IRQHandler() {
  drive.watch();
}
extern "C" void PendSV_Handler() {
  drive.tick();
}
extern "C" void cut_amplifier() {
  flexspline::nucleo_ihm08m1::Description::Bridge::cut();
}
int main() {
  drive.run();
}
