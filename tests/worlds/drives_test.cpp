// The plant of the drives of eight further kinds, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/worlds/drives/make.hpp"
#include "tests/worlds/drives/plant.hpp"
#include "tests/worlds/drives/write.hpp"

namespace flexspline::worlds::drives {
namespace {

constexpr double kStep_s = 2e-5;

Mechanics one_mass() {
  Mechanics m;
  m.torque_constant_nm_a = 0.1;
  m.motor_inertia_kgm2 = 1e-3;
  return m;
}

/// Time in s between the first and the last of `periods` upward zero crossings, over their number.
template <typename Advance>
double mean_period_s(int periods, const Advance& advance) {
  double first = 0.0;
  int crossings = 0;
  double before = advance();
  for (double time = kStep_s;; time += kStep_s) {
    const double now = advance();
    if (before < 0.0 && now >= 0.0) {
      const double crossing = time - kStep_s * now / (now - before);
      if (crossings++ == 0) first = crossing;
      if (crossings == periods + 1) return (crossing - first) / periods;
    }
    before = now;
  }
}

TEST(DrivePlant, ReachesTheTerminalVelocityOfViscousAndDryFriction) {
  Mechanics m = one_mass();
  m.friction.coulomb_nm = 0.02;
  m.friction.viscous_nms_rad = 1e-3;
  Plant plant(m, {});
  Inputs inputs;
  inputs.current_a = 1.0;
  const double steady_rad_s = (0.1 - 0.02) / 1e-3;
  const double time_constant_s = m.motor_inertia_kgm2 / m.friction.viscous_nms_rad;
  for (int k = 0; k < std::lround(time_constant_s / kStep_s); ++k) plant.step(inputs, kStep_s);
  EXPECT_NEAR(plant.state().motor_velocity_rad_s, steady_rad_s * (1.0 - std::exp(-1.0)), 1e-4 * steady_rad_s);
  for (int k = 0; k < std::lround(15.0 * time_constant_s / kStep_s); ++k) plant.step(inputs, kStep_s);
  EXPECT_NEAR(plant.state().motor_velocity_rad_s, steady_rad_s, 1e-5 * steady_rad_s);
}

TEST(DrivePlant, SwingsFreelyWithThePendulumsPeriod) {
  Mechanics m = one_mass();
  m.gear_ratio = 7.0;
  m.output_inertia_kgm2 = 0.02;
  m.gravity_nm = 1.5;
  State start;
  start.motor_position_rad = 7.0 * 0.01;
  Plant plant(m, start);
  const double period_s = mean_period_s(10, [&] {
    plant.step({}, kStep_s);
    return plant.state().output_position_rad;
  });
  const double inertia_at_output = 0.02 + 49.0 * 1e-3;
  // A swing of 0.01 rad lengthens it by a sixteenth of its square.
  EXPECT_NEAR(period_s, kTurn * std::sqrt(inertia_at_output / 1.5) * (1.0 + 0.01 * 0.01 / 16.0), 1e-6 * period_s);
}

TEST(DrivePlant, RingsAtTheResonanceOfTwoMasses) {
  Mechanics m = one_mass();
  m.is_rigid = false;
  m.gear_ratio = 10.0;
  m.output_inertia_kgm2 = 0.15;
  m.stiffness_nm_rad = 800.0;
  State start;
  start.motor_position_rad = 0.01;
  Plant plant(m, start);
  const double period_s = mean_period_s(20, [&] {
    plant.step({}, kStep_s);
    return plant.state().gear_torque_nm;
  });
  const double resonance_rad_s = std::sqrt(800.0 / 0.15 + 800.0 / (100.0 * 1e-3));
  EXPECT_NEAR(period_s, kTurn / resonance_rad_s, 1e-5 * period_s);
}

TEST(DrivePlant, RigidFrictionHoldsWithoutCreepAndSlidesAboveItsLevel) {
  Mechanics m = one_mass();
  m.friction.coulomb_nm = 0.02;
  Plant plant(m, {});
  Inputs inputs;
  inputs.current_a = 0.199;
  for (int k = 0; k < 500000; ++k) plant.step(inputs, kStep_s);
  EXPECT_EQ(plant.state().motor_position_rad, 0.0);
  inputs.current_a = 0.21;
  for (int k = 0; k < 50000; ++k) plant.step(inputs, kStep_s);
  EXPECT_NEAR(plant.state().motor_velocity_rad_s, 1.0, 1e-9);  // 1 mN m on 1e-3 kg m^2 for 1 s
}

TEST(DriveFriction, DahlsContactFollowsItsExponential) {
  FrictionLaw law;
  law.coulomb_nm = 0.05;
  law.presliding = Presliding::kDahl;
  law.presliding_rad = 0.02;
  double torque = -0.05;
  for (int k = 0; k < 100; ++k) torque = contact_torque_nm(law, torque, 3e-4, 0.05);
  EXPECT_NEAR(torque, 0.05 * (1.0 - 2.0 * std::exp(-0.03 / 0.02)), 1e-12);
}

TEST(DriveMeasurement, DelayShiftsTheCurrentByExactlyTheStatedTime) {
  Case drive;
  drive.step_s = 1e-4;
  drive.sensors.rate_hz = 1000.0;
  RecordPlan plan;
  Trace trace;
  trace.step_s = drive.step_s;
  for (int k = 0; k < 5000; ++k) trace.current_a.push_back(2.0 * k * trace.step_s);
  for (auto* column : {&trace.motor_position_rad, &trace.motor_velocity_rad_s, &trace.output_position_rad}) {
    column->assign(5000, 0.0);
  }
  const Measured prompt = measure(drive, plan, trace);
  drive.sensors.current_delay_s = 0.00237;
  const Measured late = measure(drive, plan, trace);
  // Both start after the delay's beginning, which is twice the delay later in the second.
  for (std::size_t k = 0; k < late.current_a.size(); ++k) {
    EXPECT_NEAR(late.current_a[k], prompt.current_a[k] + 2.0 * (2.0 * 0.00237 - 0.00237), 1e-9);
  }
}

TEST(DriveTruth, WithoutWhatIsHiddenNothingIsLeftOfIt) {
  for (const Kind& kind : kinds()) {
    for (const std::string_view effect : kind.hidden) {
      Random random(7, "test");
      Case drive = draw(kind, 7, 0);
      drive = without_hidden(drive);
      hide(drive, kind, effect, random);
      EXPECT_FALSE(drive.hidden.parameters.empty()) << effect;
      const Case plain = without_hidden(drive);
      const Sensors& s = plain.sensors;
      EXPECT_TRUE(plain.hidden.effect.empty());
      EXPECT_TRUE(effect != "current_delay" || s.current_delay_s + s.position_delay_s == 0.0);
      EXPECT_TRUE(effect != "gravity" || plain.mechanics.gravity_nm == 0.0);
      EXPECT_TRUE(effect != "torque_ripple" || plain.mechanics.ripples.size() == plain.residual_ripples.size());
    }
  }
}

std::string bytes_below(const std::filesystem::path& folder) {
  std::string all;
  for (const char* name : {"fit/fit-1.csv", "fit/dataset.toml", "holdout/holdout-1.csv", "model.toml", "truth.json"}) {
    std::ifstream in(folder / name, std::ios::binary);
    all.append(std::istreambuf_iterator<char>(in), {});
  }
  return all;
}

TEST(DriveFolders, SameSeedGivesSameBytes) {
  const std::filesystem::path scratch = std::filesystem::temp_directory_path() / "flexspline-drives-test";
  std::string first;
  for (const char* turn : {"one", "two"}) {
    const Made made = make_case(kinds().front(), 3);
    write_case(scratch / turn, made.drive, made.records, made.truth);
    const std::string bytes = bytes_below(scratch / turn / "leg-3");
    EXPECT_GT(bytes.size(), 10000u);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
  std::filesystem::remove_all(scratch);
}

}  // namespace
}  // namespace flexspline::worlds::drives
