// A drive that cannot run away: one speed of the matrix of tests/campaign/sensor_fault_matrix_test.cpp, and
// single checks of what makes it hold.
#include <gtest/gtest.h>

#include "tests/support/sensor_fault_cells.hpp"

namespace flexspline::tests::firmware_sensor_faults_test {
namespace {

std::string fault_of(const SensorFaultOutcome& o) {
  return std::string(firmware::info_of(o.fault).name);
}
const SensorFault& sensor_fault(std::string_view name) {
  for (const SensorFault& fault : sensor_faults())
    if (fault.name == name) return fault;
  throw std::invalid_argument(std::string(name));
}

TEST(SensorFaults, TheTrueSpeedStaysWithinATenthBeyondTheOverspeedLimit) {
  const double limit = 1.1 * demo_setup().safety.overspeed;
  const Block with = demo_block(cell_setup(true)), without = demo_block(cell_setup(false));
  for (const SensorFaultCell& cell : all_cells({0.05})) {
    if (cell.load != CellLoad::free || cell.direction < 0 || cell.compensate) continue;
    const SensorFaultOutcome o = run_cell(cell, cell.output_encoder ? with : without, 0.5);
    EXPECT_EQ(o.before, Fault::none) << "false alarm: " << cell.name();
    EXPECT_LE(o.peak_rad_s, limit) << cell.name() << ": " << fault_of(o);
    if (cell.fault->injections.empty()) {
      EXPECT_EQ(fault_of(o), "none") << cell.name();
    }
  }
}

// At full torque a free shaft passes the overspeed limit after 0.35 s.
TEST(SensorFaults, ALostLineOfASlowMotorsEncoderIsFoundInATenthOfASecondWithoutAnOutputEncoder) {
  const Block block = demo_block(cell_setup(false));
  for (const Mode mode : {Mode::velocity, Mode::position})
    for (const double share : {0.025, 0.1, 0.225})
      for (const bool compensate : {false, true}) {
        const SensorFaultCell cell{&sensor_fault("line lost"), mode, share, 1, CellLoad::free, compensate, false};
        const SensorFaultOutcome o = run_cell(cell, block);
        EXPECT_EQ(fault_of(o), "motor_encoder_stuck") << cell.name();
        EXPECT_LT(o.found_s, 0.11) << cell.name();
        EXPECT_LT(o.peak_rad_s, 0.75 * demo_drive().rated_velocity_rad_s) << cell.name();
      }
}

TEST(SensorFaults, AnOutputThatTurnsWhileTheMotorsEncoderDoesNotIsSeen) {
  const Block block = demo_block(cell_setup(true));
  const SensorFaultCell swapped{&sensor_fault("swapped direction"), Mode::velocity, 0.05};
  EXPECT_EQ(fault_of(run_cell(swapped, block)), "encoders_disagree");
  const SensorFaultCell slips{&sensor_fault("motor coupling slips"), Mode::velocity, 0.1};
  EXPECT_EQ(fault_of(run_cell(slips, block)), "encoders_disagree");
}

// What a rounded gear ratio makes in hours, and what a wrong one makes within a turn.
TEST(SensorFaults, AGearRatioThatIsOffByATwentiethOfAPercentIsNoFaultAndOneOffByThreePercentIs) {
  for (const double off : {5e-4, 0.03}) {
    plant::Drive stated = demo_drive();
    stated.gear_ratio *= 1.0 + off;
    VirtualDrive drive({.drive = demo_drive(), .seed = 1},
                       Block(board::parameters_of(stated, board::setup_of(stated)), board::constants_of(stated)));
    drive.run(100);
    drive.command(arm_velocity(150.0));
    run_with_host(drive, 8.0);
    EXPECT_EQ(firmware::info_of(drive.status().fault.fault).name, off < 1e-3 ? "none" : "encoders_disagree");
  }
}

// A drive that presses against a stop in mode current follows its command.
TEST(SensorFaults, ATorqueThatABlockedOutputHoldsForSecondsIsNoFaultInModeCurrent) {
  VirtualDrive drive({.drive = demo_drive(), .seed = 1, .locked = true}, demo_block());
  drive.run(100);
  drive.command(arm_current(0.0));
  for (const double amperes : {3.0, -3.0, 0.5, 3.5}) {
    drive.command(as_set_point(arm_current(amperes)));
    run_with_host(drive, 1.0);
    ASSERT_EQ(drive.status().mode, Mode::current) << firmware::info_of(drive.status().fault.fault).name;
  }
}

}  // namespace
}  // namespace flexspline::tests::firmware_sensor_faults_test
