// A drive with a three-phase motor: the firmware's stage on the twin's power stage and mechanical plant.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "hil/board/scenario.hpp"
#include "hil/board/three_phase.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/deployment/foc_settings.hpp"
#include "tests/support/virtual_drive.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::board::three_phase_drive_test {
namespace {

deployment::FocSetup foc_setup_of(const ThreePhaseParameters& p) {
  deployment::FocSetup s = foc_rig::setup_of({p.motor, p.inverter, p.sensors});
  s.timer_counts = 2100;
  return s;
}
void expect_near(std::int32_t a, std::int32_t b) {
  EXPECT_NEAR(a, b, 1.0 + 1e-6 * std::abs(static_cast<double>(b)));
}
plant::Drive larger_drive() {
  plant::Drive drive = plant::demo_plant().drive;
  drive.torque_constant_nm_a *= 2.0;
  drive.current_limit_a *= 3.0;
  drive.rated_velocity_rad_s *= 0.7;
  return drive;
}

TEST(ThreePhaseDrive, ItsSettingsAreThoseThatTheHostMakes) {
  for (const plant::Drive& drive : {plant::demo_plant().drive, larger_drive()}) {
    const auto made = deployment::foc_settings(foc_setup_of(three_phase_of(drive)));
    const auto has = three_phase_settings_of(drive).foc;
    expect_near(has.current.d.proportional, made.current.d.proportional);
    expect_near(has.current.q.integral, made.current.q.integral);
    expect_near(has.current.d.resistance, made.current.d.resistance);
    expect_near(has.current.d.volts_per_change, made.current.d.volts_per_change);
    expect_near(has.current.q.change_per_volt, made.current.q.change_per_volt);
    expect_near(has.current.q.reactance, made.current.q.reactance);
    expect_near(has.current.flux, made.current.flux);
    expect_near(has.current.response_per_period, made.current.response_per_period);
    EXPECT_EQ(has.current.voltage_exponent, made.current.voltage_exponent);
    expect_near(has.modulation.window, made.modulation.window);
    expect_near(has.modulation.dead_time, made.modulation.dead_time);
    expect_near(has.modulation.dead_time_gain, made.modulation.dead_time_gain);
    expect_near(has.circle, made.circle);
  }
}

TEST(ThreePhaseDrive, MakesTheTorqueOfTheCurrentThatTheApplicationAsksFor) {
  for (const plant::Drive& drive : {plant::demo_plant().drive, larger_drive()}) {
    ThreePhaseAmplifier amplifier(drive, 20'000, 1);
    const double full = scales_of(drive).amplifier_a, velocity = 0.5 * drive.rated_velocity_rad_s;
    double angle = 0.3;
    const auto run = [&](std::int16_t command, bool enabled, int ticks) {
      double mean = 0.0;
      for (int k = 0; k < ticks; ++k) {
        mean += amplifier.run({command, enabled}, angle, velocity) / ticks;
        angle += velocity / 20e3;
      }
      return mean;
    };
    EXPECT_EQ(run(8000, false, 600), 0.0) << "off";
    run(12000, true, 200);
    const double wanted = 12000.0 / 32768.0 * full;
    EXPECT_NEAR(run(12000, true, 1000), wanted, 0.01 * wanted);
    EXPECT_NEAR(amplifier.current_a(), wanted, 0.02 * wanted);
    run(-12000, true, 40);
    EXPECT_NEAR(run(-12000, true, 100), -wanted, 0.02 * wanted) << "2 ms later";
    EXPECT_EQ(run(0, false, 10), 0.0);
  }
}

TEST(ThreePhaseDrive, StaysOffWhereACurrentSensorsZeroIsOutOfRange) {
  auto settings = three_phase_settings_of(plant::demo_plant().drive);
  firmware::ThreePhaseStage stage;
  stage.begin(settings);
  stage.command({1000, true});
  for (int k = 0; k < 1100; ++k) EXPECT_FALSE(stage.update({{0, 8000, 0}, 26214, 0}).enabled);
  EXPECT_TRUE(stage.tripped());
  for (int k = 0; k < 2100; ++k) stage.update({{0, 100, 0}, 26214, 0});
  EXPECT_FALSE(stage.tripped());
  EXPECT_TRUE(stage.update({{0, 100, 0}, 26214, 0}).enabled);
}

TEST(ThreePhaseDrive, AMotorThatWasMeasuredWithAnotherEncoderIsNotUsed) {
  auto settings = three_phase_settings_of(plant::demo_plant().drive);
  settings.pole_pairs = 0;
  firmware::ThreePhaseStage stage;
  stage.begin(settings);
  control::MotorSettings motor;
  motor.pole_pairs = 7;
  motor.encoder_counts = 2 * settings.encoder_counts;
  stage.use(motor);
  EXPECT_FALSE(stage.is_commissioned()) << "its angle would run at half the speed of the rotor's";
  motor.encoder_counts = settings.encoder_counts;
  stage.use(motor);
  EXPECT_TRUE(stage.is_commissioned());
}

TEST(ThreePhaseDrive, SwitchesItsStageOffWithinTheStatedPeriodsUntilItIsDisarmed) {
  using firmware::StageFault;
  struct Case {
    firmware::ThreePhaseStage::Inputs in;
    StageFault fault;
    int periods;
  };
  const Case cases[] = {{{{0, 0, 0}, 12'000, 0}, StageFault::bus_low, 1},
                        {{{0, 0, 0}, 31'500, 0}, StageFault::bus_high, 1},
                        {{{21'000, -10'500, -10'500}, 26'214, 0}, StageFault::overcurrent, 1},
                        {{{0, 2'500, 0}, 26'214, 0}, StageFault::current_sum, 4}};
  for (const Case& c : cases) {
    firmware::ThreePhaseStage stage;
    stage.begin(three_phase_settings_of(plant::demo_plant().drive));
    const firmware::ThreePhaseStage::Inputs healthy{{0, 0, 0}, 26'214, 0};
    for (int k = 0; k < 1100; ++k) stage.update(healthy);
    // No set point: at the limit of the voltage a phase is not sampled, and the sum says nothing.
    stage.command({0, true});
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(stage.update(healthy).enabled);
    EXPECT_FALSE(stage.tripped());
    for (int k = 1; k < c.periods; ++k) EXPECT_TRUE(stage.update(c.in).enabled) << k;
    EXPECT_FALSE(stage.update(c.in).enabled);
    EXPECT_TRUE(stage.tripped());
    EXPECT_EQ(stage.fault(), c.fault);
    for (int k = 0; k < 3000; ++k) EXPECT_FALSE(stage.update(healthy).enabled) << "it stays off";
    EXPECT_EQ(stage.fault(), c.fault);
    stage.command({0, false});
    for (int k = 0; k < 2100; ++k) stage.update(healthy);
    stage.command({1000, true});
    EXPECT_TRUE(stage.update(healthy).enabled);
    EXPECT_FALSE(stage.tripped());
  }
}

// Where the voltage is at its limit some periods have a phase that is not sampled: its current is what the others
// leave, and their sum is zero whatever flows.
TEST(ThreePhaseDrive, CurrentsThatDoNotAddUpAreFoundThoughSomePeriodsSampleTwoPhases) {
  firmware::ThreePhaseStage stage;
  auto settings = three_phase_settings_of(plant::demo_plant().drive);
  settings.protection.winding = {};
  settings.most_phase = INT32_MAX;
  stage.begin(settings);
  std::uint32_t counter = 0;
  const auto step = settings.encoder_counts / static_cast<std::uint32_t>(settings.pole_pairs) / 9;
  const auto update = [&](const control::foc::Phases& readings) { return stage.update({readings, 26'214, counter}); };
  for (int k = 0; k < 1100; ++k) update({});
  stage.command({20'000, true});
  // A current that the loop cannot reach leads to the limit of the voltage, at an angle that turns.
  for (int k = 0; k < 400; ++k, counter += step) ASSERT_TRUE(update({}).enabled);
  int periods = 0;
  while (periods < 400 && update({4'000, 4'000, 4'000}).enabled) {
    ++periods;
    counter += step;
  }
  EXPECT_EQ(stage.fault(), firmware::StageFault::current_sum);
  EXPECT_LT(periods, 32) << "four that sample three phases";
}

// Errors of the whole drive in closed loop, with its own amplifier as the reference.
TEST(ThreePhaseDrive, FollowsAMotionAsADriveWithAServoAmplifier) {
  ScenarioPlan plan;
  plan.drive = plant::demo_plant().drive;
  plan.duration_s = 3.0;
  for (const char* name : {"sine", "slow-reversals"})
    for (const bool compensation : {false, true}) {
      plan.scenario = name;
      plan.compensation = compensation;
      plan.three_phase = false;
      const ScenarioResult servo = run_scenario(plan);
      plan.three_phase = true;
      const ScenarioResult three = run_scenario(plan);
      EXPECT_EQ(three.first_fault.fault, firmware::Fault::none);
      std::printf("%s, compensation %s: rms error %.3e rad, with a servo amplifier %.3e\n", name,
                  compensation ? "on" : "off", three.rms_error_rad, servo.rms_error_rad);
      // A count of the output's encoder is 24e-6.
      EXPECT_NEAR(three.rms_error_rad, servo.rms_error_rad, 0.02 * servo.rms_error_rad + 5e-7);
    }
}

deployment::CommissioningSetup commissioning_of(const ThreePhaseParameters& p) {
  deployment::CommissioningSetup s;
  s.current_full_scale_a = p.sensors.full_scale_a;
  s.bus_full_scale_v = p.sensors.bus_full_scale_v;
  s.pwm_hz = p.inverter.pwm_hz;
  s.timer_counts = 2100;
  s.shortest_pulse_s = 0.2e-6;
  s.sampling_window_s = 1.5e-6;
  s.dead_time_s = p.inverter.dead_time_s;
  s.offset_a = 0.1 * p.sensors.full_scale_a;
  s.spread_a = 0.1 * p.sensors.full_scale_a;
  s.current_a = 3.5;
  s.bus_v = p.inverter.supply_v;
  return s;
}

// The current of commissioning heats the winding as any other: a drive that is armed afterwards has less of its peak.
TEST(ThreePhaseDrive, TheCurrentOfCommissioningCountsForTheThermalLimit) {
  const plant::Drive drive = plant::demo_plant().drive;
  auto settings = three_phase_settings_of(drive);
  settings.limits.continuous_square = settings.limits.peak_square / 2;
  settings.limits.start_square = settings.limits.peak_square / 10;
  settings.limits.fade = 81'920;  // half of the peak's square over four tenths of it
  settings.limits.heating = static_cast<std::uint32_t>((std::uint64_t{1} << 32) / 4'000);
  const auto peak_a = [&](bool commissions) {
    ThreePhaseAmplifier amplifier(drive, 20'000, 1);
    amplifier.stage().begin(settings);
    for (int k = 0; k < 600; ++k) amplifier.run({}, 0.0, 0.0);
    if (commissions)
      amplifier.stage().commission(deployment::commissioning_settings(commissioning_of(three_phase_of(drive))));
    for (int k = 0; k < 40'000 && amplifier.stage().commissions(); ++k) amplifier.run({}, 0.0, 0.0);
    amplifier.stage().stop_commissioning();
    for (int k = 0; k < 600; ++k) amplifier.run({}, 0.0, 0.0);
    for (int k = 0; k < 60; ++k) amplifier.run({32'000, true}, 0.0, 0.0);
    return amplifier.current_a();
  };
  const double cold = peak_a(false), warm = peak_a(true);
  EXPECT_NEAR(cold, 32.0 / 32.768 * scales_of(drive).amplifier_a, 0.05);
  EXPECT_LT(warm, 0.85 * cold);
}

// On the drive's own mechanical plant: gear, friction, torsion, load.
TEST(ThreePhaseDrive, CommissionsItsMotorBehindTheGear) {
  const plant::Drive drive = plant::demo_plant().drive;
  const ThreePhaseParameters p = three_phase_of(drive);
  PlantRig rig({.drive = drive, .three_phase = true});
  const auto setup = commissioning_of(p);
  firmware::ThreePhaseStage& stage = rig.three_phase()->stage();
  stage.commission(deployment::commissioning_settings(setup));
  const int most_ticks = 30 * 20'000;
  for (int k = 0; k < most_ticks && stage.commissions(); ++k) rig.act({});
  ASSERT_FALSE(stage.commissions());
  const auto& r = stage.commissioning().result();
  ASSERT_EQ(deployment::commissioning_fault_text(r.fault).name, "none");
  const auto found = deployment::commissioning_findings(setup, r);
  std::printf("behind the gear: R %.4f ohm, Ld %.4f mH, Lq %.4f mH, flux %.4f mVs, lag %.1f degrees, %.1f s\n",
              found.resistance_ohm, 1e3 * found.inductance_d_h, 1e3 * found.inductance_q_h, 1e3 * found.flux_vs,
              360.0 * found.lag_turns, stage.commissioning().periods() / setup.pwm_hz);
  EXPECT_NEAR(found.resistance_ohm, p.motor.resistance_ohm + p.inverter.on_resistance_ohm, 0.03);
  EXPECT_NEAR(found.inductance_d_h, p.motor.inductance_d_h, 0.05 * p.motor.inductance_d_h);
  EXPECT_NEAR(found.inductance_q_h, p.motor.inductance_q_h, 0.05 * p.motor.inductance_q_h);
  EXPECT_NEAR(found.flux_vs, p.motor.flux_vs, 0.02 * p.motor.flux_vs);
  EXPECT_EQ(found.pole_pairs, p.motor.pole_pairs);
  EXPECT_FALSE(found.reversed);
  EXPECT_NEAR((found.offset_turns - std::round(found.offset_turns)) * 360.0, 0.0, 1.0);

  // What was found, and nothing else, sets the current loop.
  deployment::FocSetup measured = foc_setup_of(p);
  measured.resistance_ohm = found.resistance_ohm;
  measured.inductance_d_h = found.inductance_d_h;
  measured.inductance_q_h = found.inductance_q_h;
  measured.flux_vs = found.flux_vs;
  firmware::ThreePhaseSettings settings = stage.settings();
  settings.foc = deployment::foc_settings(measured);
  settings.foc.sensors.gain = r.gain;
  settings.pole_pairs = r.pole_pairs;
  settings.reversed = r.reversed;
  settings.offset_angle = r.offset_angle;
  stage.begin(settings);
  const int offset_ticks = 600, settling_ticks = 100, ticks = 200;
  for (int k = 0; k < offset_ticks; ++k) rig.act({});
  double mean = 0.0;
  for (int k = 0; k < settling_ticks; ++k) rig.act({8000, true});
  for (int k = 0; k < ticks; ++k) {
    rig.act({8000, true});
    mean += rig.current_a() / ticks;
  }
  const double wanted = 8000.0 / 32768.0 * scales_of(drive).amplifier_a;
  EXPECT_NEAR(mean, wanted, 0.01 * wanted);
  EXPECT_GT(rig.truth().motor_velocity, 0.3) << "friction takes four fifths of the torque";
}

TEST(ThreePhaseDrive, RefusesATickRateThatDoesNotDivideThePwm) {
  EXPECT_THROW(ThreePhaseAmplifier(plant::demo_plant().drive, 15'000, 1), std::invalid_argument);
  EXPECT_NO_THROW(ThreePhaseAmplifier(plant::demo_plant().drive, 10'000, 1));
}

}  // namespace
}  // namespace flexspline::board::three_phase_drive_test
