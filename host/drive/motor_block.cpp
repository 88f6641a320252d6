#include "host/drive/motor_block.hpp"

#include <span>

#include "shared/control/drive_block.hpp"

namespace flexspline::drive {
namespace {

constexpr auto kMotorKind = static_cast<std::uint16_t>(model::Section::motor);

std::uint32_t encoder_counts_of(const Bytes& block) {
  std::uint32_t counts = 0;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != static_cast<std::uint16_t>(model::Section::motor_encoder)) return;
    model::FieldReader reader(bytes);
    observers::EncoderAngle::Coefficients c;
    c.fields(reader);
    counts = c.counts;
  });
  return counts;
}

}  // namespace

control::MotorSettings motor_of(const Bytes& block) {
  return block.empty() ? control::MotorSettings{} : control::motor_of(block);
}

Bytes with_motor(const Bytes& block, const control::MotorSettings& motor) {
  constexpr std::size_t kMostBytes = 256;
  Bytes out(block.size() + kMostBytes);
  model::BlockWriter writer(out);
  writer.begin(model::header_of(block));
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != kMotorKind) writer.add_bytes(kind, bytes);
  });
  writer.add(kMotorKind, motor);
  out.resize(writer.end());
  return out;
}

Bytes keeping_motor(const Bytes& block, const Bytes& active) {
  const control::MotorSettings motor = motor_of(active);
  return motor.pole_pairs > 0 && motor.encoder_counts == encoder_counts_of(block) ? with_motor(block, motor) : block;
}

}  // namespace flexspline::drive
