// Many drives in closed loop: what compensation is worth, and whether a wrong model harms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/fault_texts.hpp"
#include "tests/support/closed_loop_runs.hpp"

namespace flexspline::tests::compensation_gain_test {
namespace {

constexpr std::uint64_t kFirstSeed = 9001;

double limit_of(const plant::Drive& drive) {
  return 2.0 * std::numbers::pi / drive.sensors.motor_counts / drive.gear_ratio;
}

void print(const char* what, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::printf("%s: %zu runs, least %.3g, median %.3g, most %.3g\n", what, values.size(), values.front(),
              values[values.size() / 2], values.back());
}

TEST(CompensationGain, OnTenRandomDrivesTheErrorAtSlowReversalsIsAtMostAFifth) {
  constexpr std::size_t kDrives = 10;
  std::vector<double> ratios(kDrives);
  std::mutex guard;
  on_all_cores(kDrives, [&](std::size_t i) {
    const plant::Drive drive = random_loop_drive(kFirstSeed + i);
    LoopRun run{.drive = drive, .block = loop_block(model_of(drive, true, true), loop_settings(drive)), .seconds = 5.0};
    const board::ScenarioResult off = run_loop(run);
    run.compensation = true;
    run.hold_s = 2.0;
    const board::ScenarioResult on = run_loop(run);
    ratios[i] = on.rms_error_rad / off.rms_error_rad;
    const std::lock_guard lock(guard);
    EXPECT_EQ(on.end.mode, firmware::Mode::position) << i << firmware::info_of(on.first_fault.fault).reason;
    EXPECT_LT(ratios[i], 0.2) << "drive " << i;
    EXPECT_FALSE(on.limit_cycle(limit_of(drive))) << "drive " << i << " swings by " << on.hold_swing_rad;
    EXPECT_LT(on.rms_current_a, 1.1 * off.rms_current_a) << "drive " << i;
  });
  print("error with compensation over that without", ratios);
}

TEST(CompensationGain, ParametersWrongByUpToThirtyPercentMakeNoDriveUnstable) {
  constexpr std::size_t kDrives = 20;
  std::vector<double> ratios(kDrives);
  std::mutex guard;
  on_all_cores(kDrives, [&](std::size_t i) {
    const plant::Drive drive = random_loop_drive(kFirstSeed + 200 + i);
    const std::string settings = loop_settings(drive);
    model::Model wrong = model_of(drive, true, true);
    std::mt19937_64 random(kFirstSeed + 300 + i);
    std::uniform_real_distribution<double> factor(0.7, 1.3);
    for (model::Effect& effect : wrong.effects)
      for (model::Parameter& p : effect.parameters) {
        const double by = factor(random);
        if (p.value && !p.fixed) *p.value *= by;
      }
    LoopRun run{.drive = drive, .block = loop_block(wrong, settings), .seconds = 3.0};
    const board::ScenarioResult off = run_loop(run);
    run.compensation = true;
    run.hold_s = 1.0;
    const board::ScenarioResult on = run_loop(run);
    ratios[i] = on.rms_error_rad / off.rms_error_rad;
    const std::lock_guard lock(guard);
    EXPECT_EQ(on.end.mode, firmware::Mode::position) << "drive " << i;
    // Far from running away: a wrong model is at worst a few times as bad as none.
    EXPECT_LT(on.peak_error_rad, 3.0 * off.peak_error_rad) << "drive " << i;
    EXPECT_LT(on.hold_swing_rad, 1e-4) << "drive " << i;
  });
  print("error with a wrong model over that without any", ratios);
}

}  // namespace
}  // namespace flexspline::tests::compensation_gain_test
