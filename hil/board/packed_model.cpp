#include "hil/board/packed_model.hpp"

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/model/block_texts.hpp"

namespace flexspline::board {
namespace {

double value_of(const model::Number& n) {
  return std::ldexp(n.mantissa, n.exponent - fixed::kMantissaBits);
}

effects::DriveConstants<double> constants_of(const model::Bases& b) {
  effects::DriveConstants<double> d;
  d.gear_ratio = value_of(b.gear_ratio);
  d.torque_constant = value_of(b.torque_constant);
  d.rated_velocity = value_of(b.rated_velocity);
  d.reference_temperature = value_of(b.reference_temperature);
  d.turn_angle_scale = value_of(b.turn_angle_scale);
  d.torque_base = value_of(b.torque);
  d.output_torque_base = value_of(b.output_torque);
  d.velocity_base = value_of(b.velocity);
  d.output_velocity_base = value_of(b.output_velocity);
  d.acceleration_base = value_of(b.acceleration);
  d.output_acceleration_base = value_of(b.output_acceleration);
  d.angle_base = value_of(b.angle);
  d.torsion_base = value_of(b.torsion);
  d.torsion_rate_base = value_of(b.torsion_rate);
  d.temperature_base = value_of(b.temperature());
  d.current_base = value_of(b.current());
  d.time_base = value_of(b.tick());
  return d;
}

}  // namespace

PackedModel read_packed_model(std::span<const std::uint8_t> bytes, std::uint32_t tick_hz) {
  const model::BlockVerdict verdict = control::check_for_drive(bytes, tick_hz);
  if (!verdict.good()) {
    std::string advice;
    if (verdict.fault == model::BlockFault::missing_section) advice = "; pack it with --drive";
    if (verdict.fault == model::BlockFault::other_tick_rate)
      advice = "; pack it with --tick-hz " + std::to_string(tick_hz);
    throw std::runtime_error(std::string("the drive refuses this block: ") + model::text_of(verdict.fault) + advice);
  }
  return {{bytes.begin(), bytes.end()}, constants_of(model::header_of(bytes).bases)};
}

PackedModel load_packed_model(const std::string& file, std::uint32_t tick_hz) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  try {
    return read_packed_model(bytes, tick_hz);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file + ": " + error.what());
  }
}

}  // namespace flexspline::board
