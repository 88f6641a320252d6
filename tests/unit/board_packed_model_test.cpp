// A model that was packed into a block drives the virtual drive: the same coefficients, the same motion.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/board/scenario.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::board_packed_model_test {
namespace {

using board::PackedModel;

// The demo's parameters as bytes, said to be of a drive with the constants `d`.
std::vector<std::uint8_t> packed(const effects::DriveConstants<double>& d) {
  const Block block(board::parameters_of(demo_drive(), demo_setup()), d);
  const auto* first = reinterpret_cast<const std::uint8_t*>(block.bytes().data());
  return {first, first + block.bytes().size()};
}

TEST(PackedModel, OfTheDriveItselfGivesTheSameMotion) {
  board::ScenarioPlan plan;
  plan.drive = demo_drive();
  plan.duration_s = 1.5;
  const auto own = board::run_scenario(plan);
  plan.packed = board::read_packed_model(packed(demo_constants()));
  const auto from_block = board::run_scenario(plan);
  EXPECT_EQ(from_block.end.mode, Mode::position);
  // The host takes the bases from the block, where they are rounded to 31 bits, so set points may differ by a unit.
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
  EXPECT_NE(reason([&] { board::read_packed_model(packed(demo_constants()), 16'000); }).find("--tick-hz"),
            std::string::npos);
  auto d = demo_constants();
  d.gear_ratio = 50.0;
  board::ScenarioPlan plan;
  plan.drive = demo_drive();
  plan.packed = board::read_packed_model(packed(d));
  EXPECT_NE(reason([&] { board::run_scenario(plan); }).find("gear"), std::string::npos);
  auto bytes = packed(demo_constants());
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_NE(reason([&] { board::read_packed_model(bytes); }).find("checksum"), std::string::npos);
  EXPECT_NE(reason([] { board::load_packed_model("none.block"); }).find("none.block"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::tests::board_packed_model_test
