// Every effect on the drive against the same effect in double, along motions over the whole envelope.
#include <gtest/gtest.h>

#include "tests/support/drive_trial.hpp"

namespace flexspline::tests::fixed_effects_test {
namespace {

constexpr double kBoundOfAnEffect = 1e-6;  // of rated torque

class EveryEffectOnADrive : public testing::TestWithParam<std::string> {};

TEST_P(EveryEffectOnADrive, AgreesWithDoubleAndCannotLeaveItsRange) {
  const catalogue::Entry& entry = catalogue::get(GetParam());
  Random random(41);
  int admissible = 0;
  double worst = 0.0, largest = 0.0;
  for (int draw = 0; draw < 200 && admissible < 4; ++draw) {
    const DriveConstants<double> drive = random_drive(random);
    auto models = admissible_block({&entry}, drive, random);
    if (!models) continue;
    ++admissible;
    const Trial trial = run(*models, drive, random, 1500);
    worst = std::max(worst, trial.worst);
    largest = std::max(largest, trial.largest);
    EXPECT_TRUE(trial.same_bits);
    EXPECT_EQ(trial.findings, 0) << OverflowLog::first();
    EXPECT_TRUE(trial.within_proof);
  }
  EXPECT_EQ(admissible, 4);
  EXPECT_LT(worst, kBoundOfAnEffect);
  EXPECT_GT(worst, 0.0);  // it is fixed point that was measured
  EXPECT_GT(largest, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Drive, EveryEffectOnADrive, testing::ValuesIn(names_on_drive()),
                         [](const auto& at) { return at.param; });

TEST(ProofOfABlock, RefusesWhatCouldLeaveItsRangeAndSaysWhy) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  const auto reason_of = [&](std::string_view name, std::vector<double> parameters) {
    Models models;
    EXPECT_TRUE(models.add_named(name, parameters, drive)) << OverflowLog::first();
    const model::Proof proof = model::prove(models.intervals);
    EXPECT_FALSE(proof.holds);
    return std::string(proof.reason);
  };
  // Twenty times rated torque at twice rated torsion.
  EXPECT_EQ(reason_of("linear_stiffness", {10.0 * drive.output_torque_base / drive.torsion_base}),
            "a torque may not be below 16 bases");
  EXPECT_EQ(reason_of("torsion_zero", {14.5 * drive.torsion_base}), "a value may leave its range");
  Models models;
  EXPECT_FALSE(models.add_named("torque_bias", {20.0 * drive.torque_base}, drive));
  EXPECT_EQ(OverflowLog::first(), "a value is not below 16 bases");
}

TEST(DriveModel, TakesAnEffectOnceAndARippleFourTimes) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  model::DriveModel<Fixed> model;
  const double friction[] = {0.04};
  const auto c = effects::CoulombFriction::derive<Fixed>(friction, drive);
  EXPECT_TRUE(model.add<effects::CoulombFriction>(c));
  EXPECT_FALSE(model.add<effects::CoulombFriction>(c));
  for (int k = 0; k < 4; ++k) {
    const double ripple[] = {1.0 + k, 0.004, 0.0};
    EXPECT_TRUE(model.add<effects::TorqueRipple>(effects::TorqueRipple::derive<Fixed>(ripple, drive)));
  }
  EXPECT_FALSE(model.add<effects::TorqueRipple>({}));
}

TEST(DriveModel, AppliesTheDeadZoneAfterTheOtherShifts) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  Models models;
  const double base = drive.torsion_base;
  ASSERT_TRUE(models.add_named("backlash", {0.5 * base}, drive));
  ASSERT_TRUE(models.add_named("torsion_zero", {0.3 * base}, drive));
  ASSERT_TRUE(models.add_named("linear_stiffness", {drive.output_torque_base / base}, drive));
  Inputs<Fixed> in;
  in.torsion = Fixed::value(1.0);
  EXPECT_NEAR(real(models.fixed.tick(in).transmission), 0.8, 1e-7);
  in.torsion = Fixed::value(0.2);
  EXPECT_NEAR(real(models.fixed.tick(in).transmission), 0.0, 1e-7);
}

TEST(DriveModel, DoesNotSeeTheWrapOfTheAngle) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  Models wrapped, plain;
  for (Models* m : {&wrapped, &plain}) ASSERT_TRUE(m->add_named("dahl_friction", {0.045, 0.05}, drive));
  const std::uint64_t near_the_end = (std::uint64_t{1} << 63) - 50'000'000;
  double largest = 0.0;
  for (int tick = 0; tick <= 100; ++tick) {
    const auto at = [&](std::uint64_t from) {
      Inputs<Fixed> in;
      in.angle.raw = static_cast<std::int64_t>(from + static_cast<std::uint64_t>(tick) * 1'000'000);
      return in;
    };
    const auto torque = plain.fixed.tick(at(0)).motor;
    EXPECT_EQ(wrapped.fixed.tick(at(near_the_end)).motor.raw, torque.raw);
    largest = std::max(largest, real(torque));
  }
  EXPECT_GT(largest, 0.9 * 0.045 / drive.torque_base);
}

// The smallest step of the angle is below half a unit of a signal here.
TEST(DriveModel, SlowMotionMovesAStateThatASignalCouldNotShow) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  const double presliding_rad = 2.0;
  const double parameters[] = {0.045, presliding_rad};
  const auto c = effects::DahlFriction::derive<Fixed>(parameters, drive);
  effects::DahlFriction::State<Fixed> wide, narrow;
  const int ticks = 100'000;
  for (int tick = 0; tick < ticks; ++tick) {
    Inputs<Fixed> before, now;
    before.angle.raw = tick;
    now.angle.raw = tick + 1;
    effects::DahlFriction::advance(wide, c, now, before);
    effects::DahlFriction::advance(narrow, c, now, before);
    narrow.deflection = Fixed::widen(Fixed::narrow(narrow.deflection));
  }
  const double expected = -std::expm1(-kTurn * std::ldexp(ticks, -32) / presliding_rad);
  EXPECT_NEAR(std::ldexp(static_cast<double>(wide.deflection.raw), -fixed::kStateBits), expected, 1e-8 * expected);
  EXPECT_EQ(narrow.deflection.raw, 0);
}

}  // namespace
}  // namespace flexspline::tests::fixed_effects_test
