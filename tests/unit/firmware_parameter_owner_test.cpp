// Who may write the parameters: background work, and only while neither the application nor the three-phase stage uses
// them. The service refuses earlier; here nothing stands before the application.
#include <gtest/gtest.h>

#include "hil/board/three_phase.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_parameter_owner_test {
namespace {

using Application = firmware::Application<board::SoftwareBoard>;

class MeasuredDrive {
 public:
  MeasuredDrive() {
    stage_.begin(settings_);
    stage_.update({{0, 0, 0}, 26'214, 0});
    board_.stage = &stage_;
    board_.readings = &readings_;
    application.begin(board_);
    application.boot_with(block_.bytes());
    for (int k = 0; k < 200; ++k) tick();
  }
  void tick() {
    ++readings_.motor_samples;
    ++readings_.output_samples;
    ++readings_.analog_samples;
    readings_.torque ^= 1;
    application.tick();
    application.background();
  }
  bool commission() {
    const auto& s = settings_;
    protocol::CommissioningBegin begin;
    begin.least_bus = s.least_bus;
    begin.current = 1 << 25, begin.most_current = 3 << 24;
    begin.most_voltage = 1 << 24, begin.voltage_ramp = 1 << 10;
    begin.slow_step = 1 << 16, begin.fast_step = 1 << 18, begin.most_shaft_step = 1 << 18, begin.step_ramp = 16;
    begin.most_travel = 1 << 20, begin.most_periods = 1 << 20;
    if (!application.commissioning().prepare(begin)) return false;
    application.submit(of_kind(Command::Kind::commission));
    tick();
    return application.status().mode == Mode::commissioning;
  }

  Application application;

 private:
  Block block_ = demo_block();
  firmware::ThreePhaseSettings settings_ = board::three_phase_settings_of(demo_drive());
  firmware::ThreePhaseStage stage_;
  board::SoftwareBoard board_;
  firmware::Readings readings_;
};

TEST(ParameterOwner, WhileAMotorIsMeasuredNoNewBlockIsTaken) {
  MeasuredDrive drive;
  ASSERT_EQ(drive.application.status().mode, Mode::idle);
  ASSERT_TRUE(drive.application.status().has_parameters);
  ASSERT_TRUE(drive.commission());
  const Block block = demo_block();
  drive.application.offer(block.bytes());
  for (int k = 0; k < 10; ++k) drive.tick();
  EXPECT_EQ(drive.application.status().mode, Mode::commissioning);
  ASSERT_TRUE(drive.application.block_finding());
  EXPECT_EQ(*drive.application.block_finding(), firmware::BlockFinding::armed);
  EXPECT_TRUE(drive.application.status().has_parameters);
}

TEST(ParameterOwner, WhileAMotorIsMeasuredNoExcitationIsTaken) {
  MeasuredDrive drive;
  const auto edit = [&] { return drive.application.edit_excitation([](auto&, bool&) {}); };
  EXPECT_TRUE(edit());
  ASSERT_TRUE(drive.commission());
  EXPECT_FALSE(edit());
}

TEST(ParameterOwner, AnIdleDriveTakesABlock) {
  MeasuredDrive drive;
  const Block block = demo_block();
  drive.application.offer(block.bytes());
  for (int k = 0; k < 10; ++k) drive.tick();
  ASSERT_TRUE(drive.application.block_finding());
  EXPECT_EQ(*drive.application.block_finding(), firmware::BlockFinding::none);
  EXPECT_TRUE(drive.application.status().has_parameters);
}

}  // namespace
}  // namespace flexspline::tests::firmware_parameter_owner_test
