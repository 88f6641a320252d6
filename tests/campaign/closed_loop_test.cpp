// The whole of a drive in closed loop: a minute of it, what compensation saves, and the same bits from the image of an
// ARM processor as from the desktop.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "firmware/fault_texts.hpp"
#include "hil/board/drive_setup.hpp"
#include "hil/board/processor.hpp"
#include "hil/board/scenario.hpp"
#include "hil/scenario/scenario_file.hpp"

namespace flexspline::tests::closed_loop_test {
namespace {

using board::Processor;
using board::ScenarioPlan;
using board::ScenarioResult;

ScenarioPlan plan_of(std::string_view scenario, double duration_s, std::uint64_t seed = 7001) {
  ScenarioPlan plan;
  plan.drive = plant::demo_plant().drive;
  plan.scenario = scenario;
  plan.duration_s = duration_s;
  plan.seed = seed;
  return plan;
}
ScenarioResult run(ScenarioPlan plan, bool compensation = true,
                   std::unique_ptr<board::Controller> controller = nullptr) {
  plan.compensation = compensation;
  const ScenarioResult result = board::run_scenario(plan, std::move(controller));
  EXPECT_EQ(result.end.mode, firmware::Mode::position) << firmware::info_of(result.end.fault.fault).reason;
  return result;
}

TEST(ClosedLoop, AMinuteOfItGivesTheSameBitsAndTheSameTelemetryInEachRun) {
  const ScenarioResult first = run(plan_of("joint-trajectory", 60.0)), again = run(plan_of("joint-trajectory", 60.0));
  EXPECT_EQ(first.ticks, 1'200'101u);
  EXPECT_EQ(first.frames, first.ticks);
  EXPECT_EQ(first.telemetry_hash, again.telemetry_hash);
  EXPECT_EQ(first.rms_error_rad, again.rms_error_rad);
  EXPECT_NE(run(plan_of("joint-trajectory", 60.0, 7002)).telemetry_hash, first.telemetry_hash);
  // Far faster than time passes.
  EXPECT_LT(first.wall_s, 30.0);
}

// Bounds below as well as above: an error that vanishes is a loop that measures itself.
TEST(ClosedLoop, CompensationFollowsCloserInEveryScenario) {
  struct Expected {
    const char* scenario;
    double rms_ratio, peak_ratio;  // with over without compensation, at most
  };
  for (const Expected& e :
       {Expected{"slow-reversals", 0.01, 0.015}, Expected{"sine", 0.01, 0.01}, Expected{"trapezoid", 0.03, 0.04},
        Expected{"joint-trajectory", 0.01, 0.01}, Expected{"constant-slow", 0.005, 0.01}}) {
    const auto plan = plan_of(e.scenario, 10.0);
    const ScenarioResult off = run(plan, false), on = run(plan, true);
    SCOPED_TRACE(e.scenario);
    RecordProperty(std::string(e.scenario) + "_rms_ratio", std::to_string(on.rms_error_rad / off.rms_error_rad));
    EXPECT_LT(on.rms_error_rad, e.rms_ratio * off.rms_error_rad);
    EXPECT_LT(on.peak_error_rad, e.peak_ratio * off.peak_error_rad);
    EXPECT_LT(off.rms_error_rad, 3e-4);
    EXPECT_GT(on.rms_error_rad, 5e-8);
    // It is another way to the same motion, not another motion.
    EXPECT_NEAR(on.rms_current_a, off.rms_current_a, 0.03 * off.rms_current_a);
  }
}

TEST(ClosedLoop, AModelThatLacksAnEffectOfTheDriveFollowsManyTimesWorse) {
  for (const char* effect : {"gravity", "stribeck_gaussian", "torque_ripple:2"}) {
    auto plan = plan_of("sine", 6.0);
    plant::with(plan.drive, effect);
    const ScenarioResult known = run(plan);
    plan.drive = plant::demo_plant().drive;
    plant::hide(plan.drive, effect);
    const ScenarioResult unknown = run(plan);
    EXPECT_GT(unknown.rms_error_rad, 4.0 * known.rms_error_rad) << effect;
    EXPECT_GT(unknown.peak_error_rad, 3.0 * known.peak_error_rad) << effect;
  }
}

// Each where it shows: what depends on the load under gravity, what depends on the temperature while it rises.
TEST(ClosedLoop, AnEffectThatIsAddedAtLeastHalvesTheErrorOfTheModelWithoutIt) {
  struct Case {
    const char* effect;
    const char* scenario;
  };
  for (const Case& c :
       {Case{"stribeck_gaussian", "slow-reversals"}, Case{"load_dependent_friction", "loaded-reversals"},
        Case{"torque_ripple:2", "slow-reversals"}, Case{"gravity", "slow-reversals"},
        Case{"temperature_viscous", "warm-up"}, Case{"structural_damping", "slow-reversals"}}) {
    scenario::ScenarioFile file = scenario::find_scenario(c.scenario);
    std::erase(file.with, c.effect);
    const auto error = [&](bool hidden, bool compensation = true) {
      auto plan = scenario::plan_of(
          file, scenario::drive_of(file, "", hidden ? std::vector<std::string>{} : std::vector<std::string>{c.effect},
                                   hidden ? c.effect : ""));
      return run(plan, compensation).rms_error_rad;
    };
    const double base = error(true), added = error(false), none = error(false, false);
    RecordProperty(std::string(c.effect) + "_of_base", std::to_string(added / base));
    EXPECT_LT(added, 0.4 * base) << c.effect;
    EXPECT_LT(added, 0.01 * none) << c.effect;
    EXPECT_GT(added, 5e-8) << c.effect;
  }
}

// A host that differentiates readings sends set points of velocity with noise, here of the whole band of the direction.
TEST(ClosedLoop, NoiseInSetPointsShakesNoDriveAtRest) {
  const plant::Drive demo = plant::demo_plant().drive;
  const auto d = board::constants_of(demo);
  const auto setup = board::setup_of(demo);
  const double start = board::initial_turns(5);
  board::VirtualDrive drive({.drive = demo, .seed = 5, .start_turns = start},
                            board::Block(board::parameters_of(demo, setup), d), {});
  drive.run(100);
  std::mt19937_64 random(6);
  std::normal_distribution<double> noise(0.0, setup.feedforward.direction_band);
  firmware::Command command;
  command.kind = firmware::Command::Kind::arm;
  command.mode = firmware::Mode::position;
  command.compensate = command.stream = true;
  command.position = {std::llround(std::ldexp(start, 32))};
  ASSERT_EQ(drive.command(command).refusal, firmware::Refusal::none);
  command.kind = firmware::Command::Kind::set;
  double lowest = 1e9, highest = -1e9, most_current = 0.0;
  for (int ms = 0; ms < 3000; ++ms) {
    command.velocity = firmware::N::value(noise(random) / d.velocity_base);
    drive.post(command);
    drive.run(board::SoftwareBoard::kTickHz / 1000);
    lowest = std::min(lowest, drive.rig().truth().motor_angle);
    highest = std::max(highest, drive.rig().truth().motor_angle);
    most_current = std::max(most_current, std::abs(drive.rig().current_a()));
  }
  EXPECT_EQ(drive.status().mode, firmware::Mode::position);
  // The feedforward of friction goes to and fro, and the shaft by less than four counts of its encoder.
  EXPECT_GT(most_current, 0.2 * 0.045 / d.torque_constant);
  EXPECT_LT(highest - lowest, 4.0 * 6.2832 / demo.sensors.motor_counts);
}

class ProcessorInTheLoop : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_regular_file(FLEXSPLINE_IMAGE))
      GTEST_SKIP() << "no firmware image at " << FLEXSPLINE_IMAGE << ": the ARM compiler is not installed";
    if (!Processor::is_installed()) GTEST_SKIP() << "qemu-system-arm is not installed";
  }
};

TEST_F(ProcessorInTheLoop, GivesTheSameTelemetryAsTheSoftwareBoardBitByBit) {
  auto plan = plan_of("sine", 2.0);
  plant::with(plan.drive, "stribeck_gaussian");
  plant::with(plan.drive, "torque_ripple:2");
  const ScenarioResult desktop = run(plan);
  for (int again = 0; again < 2; ++again) {
    auto processor = std::make_unique<Processor>(FLEXSPLINE_IMAGE);
    const ScenarioResult image = run(plan, true, std::move(processor));
    EXPECT_EQ(image.ticks, 40'101u);
    EXPECT_EQ(image.telemetry_hash, desktop.telemetry_hash);
    EXPECT_EQ(image.rms_error_rad, desktop.rms_error_rad);
  }
}

TEST_F(ProcessorInTheLoop, AFaultEndsInTheSameTickAsOnTheSoftwareBoard) {
  for (const char* name :
       {"motor-encoder-stuck", "temperature-out-of-range", "amplifier-dead", "tick-overrun", "output-line-lost"}) {
    auto plan = plan_of("sine", 1.2);
    plan.compensation = false;
    plan.injection = board::injection_named(name);
    plan.injection_s = 1.0;
    const ScenarioResult desktop = board::run_scenario(plan);
    const ScenarioResult image = board::run_scenario(plan, std::make_unique<Processor>(FLEXSPLINE_IMAGE));
    EXPECT_NE(image.end.fault.fault, firmware::Fault::none) << name;
    EXPECT_EQ(image.end.fault.fault, desktop.end.fault.fault) << name;
    EXPECT_EQ(image.end.fault.tick, desktop.end.fault.tick) << name;
    EXPECT_EQ(image.telemetry_hash, desktop.telemetry_hash) << name;
  }
}

TEST_F(ProcessorInTheLoop, TheImageEndsWhenItIsSwitchedOff) {
  Processor processor(FLEXSPLINE_IMAGE);
  processor.start(board::Block(), {}, firmware::ResetCause::power);
  firmware::CoSimulationInput down;
  for (int k = 0; k < 100; ++k) processor.tick(down);
  EXPECT_EQ(processor.stop(), 0);
  EXPECT_GT(processor.most_instructions(), 100u);
}

// A processor that is still there when its drive is gone.
class Borrowed : public board::Controller {
 public:
  explicit Borrowed(Processor& processor) : processor_(processor) {}
  void start(const board::Block& block, const firmware::TelemetrySetup& setup, firmware::ResetCause cause) override {
    processor_.start(block, setup, cause);
  }
  firmware::CoSimulationOutput tick(const firmware::CoSimulationInput& down) override { return processor_.tick(down); }
  void offer(std::span<const std::byte> block) override { processor_.offer(block); }

 private:
  Processor& processor_;
};

// The stack is as large as the linker script says; between two ticks there are 8400 cycles.
TEST_F(ProcessorInTheLoop, ATickOfAModelWithManyEffectsStaysWithinItsStackAndItsTime) {
  constexpr std::uint32_t kStackBytes = 1408, kCycles = 168'000'000 / 20'000;
  Processor processor(FLEXSPLINE_IMAGE);
  auto plan = plan_of("joint-trajectory", 0.5);
  for (const char* effect : {"stribeck_gaussian", "torque_ripple:2", "torque_ripple:7", "gravity", "kinematic_error",
                             "load_dependent_friction", "temperature_viscous"})
    plant::with(plan.drive, effect);
  run(plan, true, std::make_unique<Borrowed>(processor));
  EXPECT_EQ(processor.stop(), 0);
  RecordProperty("stack_bytes", std::to_string(processor.stack_bytes()));
  RecordProperty("most_instructions", std::to_string(processor.most_instructions()));
  RecordProperty("mean_instructions", std::to_string(processor.mean_instructions()));
  EXPECT_LT(processor.stack_bytes(), kStackBytes);
  EXPECT_GT(processor.stack_bytes(), 400u);
  EXPECT_LT(processor.most_instructions(), kCycles);
}

}  // namespace
}  // namespace flexspline::tests::closed_loop_test
