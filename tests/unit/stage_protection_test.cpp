// Protection of a three-phase power stage: its arithmetic against the equations in double, its faults against the
// stated periods.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <set>
#include <string_view>

#include "hil/board/three_phase.hpp"
#include "host/drive_link/deployment/stage_settings.hpp"
#include "shared/protocol/texts.hpp"
#include "tests/support/virtual_drive.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::board::stage_protection_test {
namespace {

using control::protection::BrakeChopper;
using control::protection::Thermistor;
using control::protection::ThermistorFault;
using firmware::StageFault;

TEST(StageProtection, TheTableOfAThermistorFollowsTheBetaEquation) {
  for (const bool to_ground : {true, false})
    for (const auto& [ohm, beta] : {std::pair{10e3, 3435.0}, std::pair{10e3, 3984.0}, std::pair{22e3, 3435.0}}) {
      deployment::ThermistorSetup setup;
      setup.ohm_at_25 = ohm;
      setup.beta = beta;
      setup.to_ground = to_ground;
      const auto settings = deployment::thermistor_settings(setup);
      double worst = 0.0;
      for (double celsius = -20.0; celsius <= 110.0; celsius += 0.37) {
        const double resistance = ohm * std::exp(beta * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
        const double low = to_ground ? resistance : setup.divider_ohm;
        const auto reading = static_cast<std::int32_t>(std::lround(32768.0 * low / (resistance + setup.divider_ohm)));
        worst = std::max(worst, std::abs(control::protection::celsius(settings, reading) / 128.0 - celsius));
      }
      std::printf("beta %.0f, %.0f ohm, thermistor %s: within %.2f degrees\n", beta, ohm,
                  to_ground ? "to ground" : "to the supply", worst);
      EXPECT_LT(worst, 1.0);
    }
}

TEST(StageProtection, AnOpenAShortedAndAHotThermistorAreFoundWithinTheStatedSamples) {
  for (const bool to_ground : {true, false}) {
    deployment::ThermistorSetup setup;
    setup.to_ground = to_ground;
    const auto s = deployment::thermistor_settings(setup);
    const auto first = [&](std::int32_t reading, ThermistorFault wanted) {
      Thermistor thermistor;
      for (int k = 0; k < 100; ++k) EXPECT_EQ(thermistor.update(s, 16384), ThermistorFault::none);
      for (std::uint32_t k = 1; k < 1000; ++k) {
        const ThermistorFault found = thermistor.update(s, reading);
        if (found == ThermistorFault::none) continue;
        EXPECT_EQ(found, wanted);
        return k;
      }
      return 0U;
    };
    EXPECT_EQ(first(to_ground ? 32700 : 30, ThermistorFault::open), Thermistor::kWireSamples);
    EXPECT_EQ(first(to_ground ? 30 : 32700, ThermistorFault::shorted), Thermistor::kWireSamples);
    // 105 degrees.
    const double share = std::exp(3435.0 * (1.0 / 378.15 - 1.0 / 298.15));
    const auto hot = static_cast<std::int32_t>(std::lround(32768.0 * (to_ground ? share : 1.0) / (1.0 + share)));
    EXPECT_EQ(first(hot, ThermistorFault::hot), Thermistor::kHotSamples);
  }
}

TEST(StageProtection, AHotStageStaysHotUntilItIsBelowTheLowerTemperature) {
  const auto s = deployment::thermistor_settings({});
  Thermistor thermistor;
  for (int k = 0; k < 300; ++k) thermistor.update(s, thermistor_reading(101.0));
  EXPECT_EQ(thermistor.update(s, thermistor_reading(95.0)), ThermistorFault::hot);
  EXPECT_EQ(thermistor.update(s, thermistor_reading(88.0)), ThermistorFault::none);
}

deployment::ChopperSetup brake_of_20_ohm() {
  deployment::ChopperSetup setup;
  setup.bus_full_scale_v = 60.0;
  setup.pwm_hz = 40e3;
  setup.begin_v = 51.0;
  setup.full_v = 54.0;
  setup.ohm = 20.0;
  setup.energy_j = 20.0;
  setup.continuous_w = 5.0;
  return setup;
}

// Duty and heat by the two equations in double.
TEST(StageProtection, TheBrakeResistorsShareAndItsHeatFollowTheirEquations) {
  const auto s = deployment::chopper_settings(brake_of_20_ohm());
  BrakeChopper chopper;
  double heat_j = 0.0;
  int on = 0;
  for (int k = 0; k < 8000; ++k) {
    const double bus = 50.0 + 3.0 * std::sin(k * 1e-3);
    const double duty = chopper.update(s, static_cast<std::int32_t>(std::lround(bus / 60.0 * 32768.0))) / 32768.0;
    EXPECT_NEAR(duty, std::clamp((bus - 51.0) / 3.0 * 0.9, 0.0, 0.9), 1e-3);
    heat_j += duty * bus * bus / 20.0 / 40e3 - heat_j * 5.0 / 20.0 / 40e3;
    if (duty > 0.0) ++on;
  }
  EXPECT_GT(on, 1000);
  EXPECT_NEAR(std::ldexp(static_cast<double>(chopper.heat()), -30) * 60.0 * 60.0 / 20.0 / 40e3, heat_j, 2e-3 * heat_j);
}

TEST(StageProtection, ABrakeResistorThatTookItsEnergyGoesOffUntilHalfOfItHasGone) {
  const auto s = deployment::chopper_settings(brake_of_20_ohm());
  BrakeChopper chopper;
  const std::int32_t bus = 29'900;  // 54.7 V: 0.9 of 150 W
  int periods = 0;
  while (chopper.update(s, bus) > 0) ++periods;
  // heat(t) = P tau (1 - exp(-t/tau)), tau = 4 s.
  const double power = 0.9 * std::pow(bus / 32768.0 * 60.0, 2) / 20.0;
  EXPECT_NEAR(periods / 40e3, -4.0 * std::log(1.0 - 20.0 / (4.0 * power)), 1e-3);
  EXPECT_TRUE(chopper.is_limited());
  int waits = 0;
  while (chopper.update(s, bus) == 0) ++waits;
  EXPECT_NEAR(waits / 40e3, 4.0 * std::log(2.0), 1e-2);
}

TEST(StageProtection, ItsSettingsOnTheTwinAreThoseThatTheHostMakes) {
  const plant::Drive drive = plant::demo_plant().drive;
  const ThreePhaseParameters p = three_phase_of(drive);
  const firmware::ProtectionSettings has = protection_of(drive);
  const auto thermistor = deployment::thermistor_settings({});
  EXPECT_EQ(has.thermistor.celsius, thermistor.celsius);
  EXPECT_EQ(has.thermistor.least, thermistor.least);
  EXPECT_EQ(has.thermistor.most, thermistor.most);
  EXPECT_EQ(has.thermistor.limit, thermistor.limit);
  EXPECT_EQ(has.thermistor.restart, thermistor.restart);
  const auto chopper = deployment::chopper_settings({.bus_full_scale_v = p.sensors.bus_full_scale_v,
                                                     .pwm_hz = p.inverter.pwm_hz,
                                                     .begin_v = 51.0 / 60.0 * p.sensors.bus_full_scale_v,
                                                     .full_v = 54.0 / 60.0 * p.sensors.bus_full_scale_v,
                                                     .ohm = p.inverter.brake_ohm,
                                                     .energy_j = 20.0,
                                                     .continuous_w = 5.0});
  EXPECT_EQ(has.chopper.begin, chopper.begin);
  EXPECT_NEAR(has.chopper.slope, chopper.slope, 1);
  EXPECT_EQ(has.chopper.most_duty, chopper.most_duty);
  EXPECT_NEAR(static_cast<double>(has.chopper.most_heat), static_cast<double>(chopper.most_heat),
              1e-3 * static_cast<double>(chopper.most_heat));
  EXPECT_NEAR(has.chopper.cooling, chopper.cooling, 1);
  const auto winding =
      deployment::winding_settings(foc_rig::setup_of({p.motor, p.inverter, p.sensors}), scales_of(drive).amplifier_a);
  EXPECT_NEAR(has.winding.least_current, winding.least_current, 1);
  EXPECT_NEAR(has.winding.resistance_error, winding.resistance_error, 1);
  EXPECT_NEAR(has.winding.lost_voltage, winding.lost_voltage, 1);
}

// A host from before these faults shows an amplifier's fault, and nothing of its limit.
TEST(StageProtection, EachFaultHasANameAndAReasonAndTravelsInTheLimitOfAnAmplifierFault) {
  std::set<std::string_view> names, reasons;
  const auto amplifier = static_cast<std::uint8_t>(firmware::Fault::amplifier_fault);
  for (std::int32_t k = 0; k < static_cast<std::int32_t>(protocol::kStageFaults); ++k) {
    const protocol::FaultText text = protocol::fault_text(amplifier, k);
    EXPECT_EQ(text.name, "amplifier_fault");
    EXPECT_EQ(text.reason, protocol::stage_fault_text(k).reason);
    names.insert(protocol::stage_fault_text(k).name);
    reasons.insert(text.reason);
  }
  EXPECT_EQ(names.size(), protocol::kStageFaults);
  EXPECT_EQ(reasons.size(), protocol::kStageFaults);
  EXPECT_EQ(protocol::fault_text(amplifier, 0).reason, protocol::fault_text(amplifier).reason) << "it does not say why";
  EXPECT_NE(protocol::fault_text(amplifier, 99).reason, protocol::fault_text(amplifier).reason);
  EXPECT_EQ(protocol::fault_text(static_cast<std::uint8_t>(firmware::Fault::overspeed), 3).reason,
            protocol::fault_text(static_cast<std::uint8_t>(firmware::Fault::overspeed)).reason);
}

using Stage = firmware::ThreePhaseStage;
constexpr Stage::Inputs kHealthy{{0, 0, 0}, 26'214, 0};

Stage idle_stage() {
  Stage stage;
  stage.begin(three_phase_settings_of(plant::demo_plant().drive));
  for (int k = 0; k < 1100; ++k) stage.update(kHealthy);
  return stage;
}

TEST(StageProtection, TheBootstrapSuppliesAreChargedByTheLowSidesForTheStatedTimeBeforeEachStart) {
  Stage stage = idle_stage();
  for (int starts = 0; starts < 2; ++starts) {
    stage.command({1000, true});
    for (int k = 0; k < 40; ++k) {
      const auto out = stage.update(kHealthy);
      EXPECT_TRUE(out.enabled);
      EXPECT_EQ(out.counts.a + out.counts.b + out.counts.c, 0) << k;
    }
    const auto out = stage.update(kHealthy);
    EXPECT_TRUE(out.enabled);
    EXPECT_GT(out.counts.a + out.counts.b + out.counts.c, 0);
    stage.command({0, false});
    EXPECT_FALSE(stage.update(kHealthy).enabled);
  }
}

TEST(StageProtection, FaultsOfItsPartsOpenTheSwitchesWithinTheStatedPeriods) {
  struct Case {
    Stage::Inputs in;
    StageFault fault;
  };
  const Case cases[] = {{{{0, 0, 0}, 26'214, 0, true}, StageFault::driver},
                        {{{0, 0, 0}, 26'214, 0, false, 32'752}, StageFault::thermistor_open},
                        {{{0, 0, 0}, 26'214, 0, false, 0}, StageFault::thermistor_shorted},
                        {{{0, 0, 0}, 26'214, 0, false, thermistor_reading(105.0)}, StageFault::hot}};
  for (const Case& c : cases)
    for (const int before : {10, 200}) {  // while it charges, while it runs
      Stage stage = idle_stage();
      stage.command({0, true});
      for (int k = 0; k < before; ++k) ASSERT_TRUE(stage.update(kHealthy).enabled);
      std::uint32_t periods = 1;
      while (stage.update(c.in).enabled && periods < 10'000) ++periods;
      EXPECT_EQ(periods, firmware::periods_of(c.fault)) << protocol::stage_fault_text(static_cast<int>(c.fault)).name;
      EXPECT_EQ(stage.fault(), c.fault);
      EXPECT_TRUE(stage.tripped());
      // Armed again with the cause still there: no switch closes.
      stage.command({0, false});
      for (int k = 0; k < 100; ++k) stage.update(c.in);
      stage.command({0, true});
      for (int k = 0; k < 100; ++k) EXPECT_FALSE(stage.update(c.in).enabled);
      EXPECT_EQ(stage.fault(), c.fault);
    }
}

TEST(StageProtection, TheDriversResetIsAskedForOnceEachTimeThatTheStageIsOff) {
  Stage stage = idle_stage();
  Stage::Inputs bad = kHealthy;
  bad.driver_fault = true;
  stage.command({0, true});
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(stage.update(bad).clears_driver) << "armed";
  for (int stays = 0; stays < 2; ++stays) {
    stage.command({0, false});
    int pulses = 0, periods = 0;
    bool before = false;
    for (int k = 0; k < 5000; ++k) {
      const bool now = stage.update(bad).clears_driver;
      if (now && !before) ++pulses;
      if (now) ++periods;
      before = now;
    }
    EXPECT_EQ(pulses, 1);
    EXPECT_EQ(periods, 8);
    stage.command({0, true});
    EXPECT_FALSE(stage.update(bad).enabled);
  }
}

// Settings of the nominal motor; R by a hot winding, L and flux by 20 and 15 %. At three times rated speed the voltage
// ends before the largest current is there; above, back-EMF beyond the voltage drives an overcurrent.
TEST(StageProtection, NoFaultIsFoundOnMotorsThatDifferFromTheirModel) {
  const plant::Drive drive = plant::demo_plant().drive;
  std::mt19937_64 random(3);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  constexpr int kMotors = 60, kTicks = 4000, kStepTicks = 100;
  for (int motor = 0; motor < kMotors; ++motor) {
    ThreePhaseParameters p = three_phase_of(drive);
    p.motor.resistance_ohm *= uniform(0.8, 1.35);
    p.motor.inductance_d_h *= uniform(0.8, 1.2);
    p.motor.inductance_q_h *= uniform(0.8, 1.2);
    p.motor.flux_vs *= uniform(0.85, 1.15);
    ThreePhaseAmplifier amplifier(drive, 20'000, static_cast<std::uint64_t>(motor), p);
    const double top = drive.rated_velocity_rad_s * (motor % 3 == 0 ? uniform(-3.0, 3.0) : uniform(-1.2, 1.2));
    double angle = uniform(-3.0, 3.0);
    for (int k = 0; k < 600; ++k) amplifier.run({}, angle, 0.0);
    double command = 0.0;
    for (int k = 0; k < kTicks; ++k) {
      if (k % kStepTicks == 0) command = uniform(-26'000.0, 26'000.0);
      // Armed at rest, as a drive is: charging the bootstrap supplies shorts the motor.
      const double velocity = top * std::clamp((k - 200) / 1000.0, 0.0, 1.0);
      amplifier.run({static_cast<std::int16_t>(command), true}, angle, velocity);
      angle += velocity / 20e3;
      ASSERT_FALSE(amplifier.stage().tripped())
          << "motor " << motor << " at " << velocity
          << " rad/s: " << protocol::stage_fault_text(static_cast<std::int32_t>(amplifier.stage().fault())).name;
    }
  }
}

// A part that is not there costs nothing.
TEST(StageProtection, AStageWithoutThosePartsIgnoresTheirInputs) {
  using Bare = firmware::ThreePhaseStageOf<firmware::StageParts{}>;
  EXPECT_LT(sizeof(Bare), sizeof(Stage));
  EXPECT_LE(sizeof(firmware::StageProtection<firmware::StageParts{}>), 4U);
  Bare stage;
  stage.begin(three_phase_settings_of(plant::demo_plant().drive));
  const Bare::Inputs in{{0, 0, 0}, 29'000, 0, true, 0};
  for (int k = 0; k < 1100; ++k) stage.update(in);
  stage.command({0, true});
  const auto out = stage.update(in);
  EXPECT_TRUE(out.enabled);
  EXPECT_GT(out.counts.a, 0) << "no charge of bootstrap supplies";
  EXPECT_EQ(out.brake, 0);
  EXPECT_FALSE(out.clears_driver);
}

}  // namespace
}  // namespace flexspline::board::stage_protection_test
