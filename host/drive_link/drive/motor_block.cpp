#include "host/drive_link/drive/motor_block.hpp"

#include "host/drive_link/drive/block_sections.hpp"

namespace flexspline::drive {
control::MotorSettings motor_of(const Bytes& block) {
  return block.empty() ? control::MotorSettings{} : control::motor_of(block);
}

Bytes with_motor(const Bytes& block, const control::MotorSettings& motor) {
  return with_section(block, model::Section::motor, &motor);
}

Bytes keeping_motor(const Bytes& block, const Bytes& active) {
  const control::MotorSettings motor = motor_of(active);
  return motor.pole_pairs > 0 && motor.encoder_counts == encoder_counts_in(block, model::Section::motor_encoder)
             ? with_motor(block, motor)
             : block;
}

}  // namespace flexspline::drive
