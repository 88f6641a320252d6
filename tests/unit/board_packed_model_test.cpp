// A model that was packed into a block drives the virtual drive: the same coefficients, the same motion.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/board/scenario.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests {
namespace {

using board::PackedModel;

model::Number number_of(double x) {
  model::Number n;
  n.mantissa = static_cast<std::int32_t>(std::lround(std::ldexp(std::frexp(x, &n.exponent), fixed::kMantissaBits)));
  return n;
}
// The demo's model as bytes, with the bases of `d`.
std::vector<std::uint8_t> packed(effects::DriveConstants<double> d) {
  model::BlockHeader h;
  auto& b = h.bases;
  b.gear_ratio = number_of(d.gear_ratio);
  b.torque_constant = number_of(d.torque_constant);
  b.rated_velocity = number_of(d.rated_velocity);
  b.reference_temperature = number_of(d.reference_temperature);
  b.turn_angle_scale = number_of(d.turn_angle_scale);
  b.torque = number_of(d.torque_base);
  b.output_torque = number_of(d.output_torque_base);
  b.velocity = number_of(d.velocity_base);
  b.output_velocity = number_of(d.output_velocity_base);
  b.acceleration = number_of(d.acceleration_base);
  b.output_acceleration = number_of(d.output_acceleration_base);
  b.angle = number_of(d.angle_base);
  b.torsion = number_of(d.torsion_base);
  b.torsion_rate = number_of(d.torsion_rate_base);
  b.others = {number_of(d.temperature_base), number_of(d.current_base), number_of(d.time_base)};
  const auto half = N::value(0.5), one = N::value(1.0);
  h.limits = {one, one, half, one, one, one, half};
  std::vector<std::uint8_t> bytes(model::kLargestBlock);
  model::BlockWriter writer(bytes);
  writer.begin(h);
  auto parameters = board::parameters_of(demo_drive(), demo_setup());
  parameters.model.for_each([&]<class Effect>(model::Places<Effect, N>& places) {
    for (std::size_t i = 0; i < places.count; ++i)
      writer.add(static_cast<std::uint16_t>(model::DriveModel<N>::number_of<Effect>()), places.coefficients[i]);
  });
  bytes.resize(writer.end());
  return bytes;
}

TEST(PackedModel, OfTheDriveItselfGivesTheSameMotion) {
  board::ScenarioPlan plan;
  plan.drive = demo_drive();
  plan.duration_s = 1.5;
  const auto own = board::run_scenario(plan);
  plan.packed = board::read_packed_model(packed(demo_constants()));
  const auto from_block = board::run_scenario(plan);
  EXPECT_EQ(from_block.end.mode, Mode::position);
  // Bases are rounded to 31 bits in a block, so set points may differ by a unit.
  EXPECT_NEAR(from_block.rms_error_rad, own.rms_error_rad, 0.01 * own.rms_error_rad);
  EXPECT_NEAR(from_block.rms_current_a, own.rms_current_a, 1e-3 * own.rms_current_a);
}

TEST(PackedModel, ForAnotherTickOrGearAndBytesThatAreNoBlockAreRefusedWithTheReason) {
  const auto reason = [](const auto& act) -> std::string {
    try {
      act();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  auto d = demo_constants();
  d.time_base = 1.0 / 16'000.0;
  EXPECT_NE(reason([&] { board::parameters_of(demo_drive(), board::read_packed_model(packed(d))); }).find("--tick-hz"),
            std::string::npos);
  d = demo_constants();
  d.gear_ratio = 50.0;
  EXPECT_NE(reason([&] { board::parameters_of(demo_drive(), board::read_packed_model(packed(d))); }).find("gear"),
            std::string::npos);
  auto bytes = packed(demo_constants());
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_NE(reason([&] { board::read_packed_model(bytes); }).find("checksum"), std::string::npos);
  EXPECT_NE(reason([] { board::load_packed_model("none.block"); }).find("none.block"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::tests
