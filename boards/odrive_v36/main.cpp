// The application on an ODrive v3.6.
#include "boards/odrive_v36/board.hpp"
#include "boards/stm32f4/drive.hpp"

namespace {
constinit flexspline::stm32f4::Drive<flexspline::odrive_v36::Description> drive;
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
  flexspline::odrive_v36::Description::cut();
}
int main() {
  drive.run();
}
