// A table as an effect: straight lines between its points in double, with derivatives, and on a drive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "tests/support/drive_trial.hpp"

namespace flexspline::tests::table_effect_test {
namespace {

using catalogue::Balance;
using effects::TableEffect;
using effects::Variable;

model::Effect table_of(const std::string& variable, std::vector<double> at, std::vector<double> value,
                       bool times_direction = false, const std::string& balance = "motor") {
  model::Effect effect{"table_effect", "table", {}, model::Definition{}};
  effect.definition->variable = variable;
  effect.definition->balance = balance;
  effect.definition->times_direction = times_direction;
  effect.definition->table.at = std::move(at);
  effect.definition->table.value = std::move(value);
  return effect;
}

// Written once more: the line between the two points around x.
double line(const std::vector<double>& at, const std::vector<double>& value, double x) {
  if (x <= at.front()) return value.front();
  for (std::size_t k = 1; k < at.size(); ++k)
    if (x <= at[k]) return value[k - 1] + (value[k] - value[k - 1]) * (x - at[k - 1]) / (at[k] - at[k - 1]);
  return value.back();
}

double torque_of(const catalogue::Entry& entry, const Inputs<Real>& in, const DriveConstants<double>& drive = {}) {
  double sum = 0.0;
  entry.real.torque(nullptr, drive, entry.info->balance, {&in, 1}, &sum);
  return sum;
}

TEST(TableEffect, IsStraightBetweenItsPointsAndHeldBeyondThem) {
  Random random(1);
  for (int draw = 0; draw < 50; ++draw) {
    const std::size_t points = 2 + random() % 255;
    const double low = between(random, -100.0, 50.0);
    const std::vector<double> at = catalogue::even_points(low, low + log_between(random, 0.1, 200.0), points);
    std::vector<double> value(points);
    for (double& v : value) v = between(random, -1.0, 1.0);
    const catalogue::Entry& entry = catalogue::entry_of(table_of("torque", at, value));
    for (int k = 0; k < 100; ++k) {
      Inputs<Real> in;
      in.torque = between(random, at.front() - 0.2 * (at.back() - low), at.back() + 0.2 * (at.back() - low));
      EXPECT_NEAR(torque_of(entry, in), line(at, value, in.torque), 1e-11);
    }
    for (std::size_t k = 0; k < points; ++k) {
      Inputs<Real> in;
      in.torque = at[k];
      EXPECT_NEAR(torque_of(entry, in), value[k], 1e-9);
    }
  }
}

TEST(TableEffect, OverAnAngleItComesBackAfterATurn) {
  const std::vector<double> value{0.3, -0.1, 0.2, 0.7, -0.4};
  const catalogue::Entry& entry = catalogue::entry_of(table_of("motor_angle", catalogue::points_of_turn(5), value));
  std::vector<double> at = catalogue::points_of_turn(5), closed = value;
  at.push_back(kTurn);
  closed.push_back(value.front());
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    const double within = between(random, 0.0, kTurn);
    const double turns = std::floor(between(random, -50.0, 50.0));
    Inputs<Real> in;
    in.angle = within + turns * kTurn;
    EXPECT_NEAR(torque_of(entry, in), line(at, closed, within), 1e-11);
    // On a linear axis a turn of the motor is a pitch of travel.
    DriveConstants<double> screw;
    screw.turn_angle_scale = kTurn / 0.02;
    in.angle = (within / kTurn + turns) * 0.02;
    EXPECT_NEAR(torque_of(entry, in, screw), line(at, closed, within), 1e-9);
  }
}

TEST(TableEffect, TakesTheDirectionOfItsBalance) {
  const auto entry_on = [](const std::string& balance) -> const catalogue::Entry& {
    return catalogue::entry_of(table_of("temperature", {0.0, 100.0}, {1.0, 3.0}, true, balance));
  };
  Inputs<Real> in;
  in.temperature = 50.0;
  in.direction = -1.0;
  in.torsion_direction = 0.5;
  in.output_direction = 0.25;
  EXPECT_DOUBLE_EQ(torque_of(entry_on("motor"), in), -2.0);
  EXPECT_DOUBLE_EQ(torque_of(entry_on("transmission"), in), 1.0);
  EXPECT_DOUBLE_EQ(torque_of(entry_on("load"), in), 0.5);
  EXPECT_EQ(entry_on("load").info->balance, Balance::load);
  EXPECT_TRUE(entry_on("load").adds_to(Balance::load));
  EXPECT_FALSE(entry_on("load").adds_to(Balance::motor));
  EXPECT_EQ(entry_on("load").label, "table_effect:temperature*direction");
}

TEST(TableEffect, EverySignalCanBeItsVariable) {
  const auto set = [](Inputs<Real>& in, Variable v, double x) {
    switch (v) {
      case Variable::velocity:
        return in.velocity = x;
      case Variable::speed:
        return in.speed = x;
      case Variable::acceleration:
        return in.acceleration = x;
      case Variable::motor_angle:
        return in.angle = x;
      case Variable::output_velocity:
        return in.output_velocity = x;
      case Variable::output_acceleration:
        return in.output_acceleration = x;
      case Variable::output_angle:
        return in.output_angle = x;
      case Variable::torsion:
        return in.torsion = x;
      case Variable::torsion_rate:
        return in.torsion_rate = x;
      case Variable::torque:
        return in.torque = x;
      case Variable::torque_magnitude:
        return in.torque_magnitude = x;
      case Variable::current:
        return in.current = x;
      case Variable::temperature:
        return in.temperature = x;
    }
    return 0.0;
  };
  for (const effects::VariableInfo& v : effects::kVariables) {
    SCOPED_TRACE(v.name);
    const std::vector<double> at = v.periodic ? catalogue::points_of_turn(4) : catalogue::even_points(-3.0, 3.0, 4);
    const catalogue::Entry& entry = catalogue::entry_of(table_of(std::string(v.name), at, {1.0, 2.0, 4.0, 8.0}));
    Inputs<Real> in;
    set(in, v.variable, at[2]);
    EXPECT_NEAR(torque_of(entry, in), 4.0, 1e-12);
    EXPECT_EQ(entry.info->reads, v.reads);
    EXPECT_EQ(catalogue::find_variable(v.name)->variable, v.variable);
  }
}

TEST(TableEffect, DerivativeIsTheSlopeOfItsLine) {
  const catalogue::Entry& entry = catalogue::entry_of(table_of("torsion", {-1.0, 0.0, 1.0}, {5.0, 1.0, 2.0}));
  for (const auto& [x, slope] : {std::pair{-0.5, -4.0}, {0.25, 1.0}, {1.5, 0.0}, {-2.0, 0.0}}) {
    effects::Inputs<numbers::Dual> in;
    in.torsion = numbers::Jet(x, 0);
    numbers::Jet sum(0.0);
    entry.dual.torque(nullptr, {}, Balance::motor, {&in, 1}, &sum);
    EXPECT_DOUBLE_EQ(sum.v[0], slope);
  }
}

TEST(TableEffect, WithoutValuesItAddsNothingAndIsMissing) {
  const model::Effect blank = table_of("velocity", {}, {});
  Inputs<Real> in;
  in.velocity = 3.0;
  EXPECT_EQ(torque_of(catalogue::entry_of(blank), in), 0.0);
  EXPECT_EQ(catalogue::missing_values(blank), std::vector<std::string>{"table"});
  EXPECT_TRUE(catalogue::missing_values(table_of("velocity", {0.0, 1.0}, {1.0, 1.0})).empty());
}

TEST(TableEffect, RefusesPointsThatAreNotEven) {
  const auto what = [](const model::Effect& effect) {
    const auto objection = catalogue::objection_to(effect);
    return objection ? objection->key + ": " + objection->what : "";
  };
  EXPECT_EQ(what(table_of("velocity", {0.0, 1.0, 2.0}, {0.0, 0.0, 0.0})), "");
  EXPECT_EQ(what(table_of("velocity", {0.0, 1.0, 3.0}, {0.0, 0.0, 0.0})),
            "table: point 2 of the table is at 1, and even steps would have it at 1.5");
  EXPECT_NE(what(table_of("velocity", {1.0, 0.0}, {0.0, 0.0})), "");
  EXPECT_EQ(what(table_of("velocity", {1.0}, {0.0})), "table: the table has 1 points");
  EXPECT_EQ(what(table_of("velocity", catalogue::even_points(0.0, 1.0, 257), std::vector<double>(257))),
            "table: the table has 257 points");
  EXPECT_NE(what(table_of("motor_angle", {0.0, 1.0, 2.0}, {0.0, 0.0, 0.0})), "");
  EXPECT_EQ(what(table_of("velocty", {}, {})), "variable: there is no signal \"velocty\"");
  EXPECT_THROW(catalogue::entry_of(table_of("velocty", {}, {})), model::ModelError);
}

// Bound of a table on a drive: half a unit of each of its values and of the result, a unit of resolution of the signal
// and of the first point times the steepest line, and the rounding of the steps.
TEST(TableEffect, OnADriveStaysWithinItsBoundOfDoubleOverRandomTables) {
  Random random(11);
  int tables = 0;
  double worst = 0.0, worst_share_of_bound = 0.0;
  while (tables < 300) {
    const DriveConstants<double> drive = random_drive(random);
    const effects::VariableInfo& v = effects::kVariables[random() % std::size(effects::kVariables)];
    std::vector<double> p(TableEffect::kParameters.size(), 0.0);
    const auto balance = static_cast<Balance>(random() % 3);
    const int points = 2 + static_cast<int>(random() % 255);
    const double base = effects::base_of(v.variable, drive);
    const double low = between(random, -2.0, 1.5);
    const double range = log_between(random, 0.05, 2.0);
    p[0] = static_cast<double>(v.variable);
    p[1] = static_cast<double>(balance);
    p[2] = static_cast<double>(random() % 2);
    p[3] = points;
    p[4] = low * base;
    p[5] = (low + range) * base;
    const double torque = balance == Balance::motor ? drive.torque_base : drive.output_torque_base;
    const double rough = between(random, 0.0, 1.0) < 0.5 ? 1.0 : 0.05;
    double value = between(random, -1.0, 1.0);
    double steepest = 0.0;
    for (int k = 0; k < points; ++k) {
      const double before = value;
      value = std::clamp(value + rough * between(random, -1.0, 1.0), -1.5, 1.5);
      steepest = k > 0 ? std::max(steepest, std::abs(value - before)) : 0.0;
      p[static_cast<std::size_t>(TableEffect::kStated + k)] = value * torque;
    }
    if (v.periodic) steepest = std::max(steepest, 3.0);
    Models models;
    ASSERT_TRUE(models.add<TableEffect>(p.data(), drive)) << fixed::OverflowLog::first();
    ASSERT_TRUE(model::prove(models.intervals).holds);
    const Trial trial = run(models, drive, random, 300);
    EXPECT_TRUE(trial.same_bits);
    EXPECT_EQ(trial.findings, 0) << fixed::OverflowLog::first();
    EXPECT_TRUE(trial.within_proof);
    constexpr double kUnit = 0x1p-27;
    const double steps_per_base = v.periodic ? 0.0 : (points - 1) / range;
    const double position = kUnit * steps_per_base + 0x1p-31 * 4.0 * steps_per_base + points * 0x1p-31;
    const double bound = 1.5 * kUnit + steepest * (position + 0x1p-30);
    EXPECT_LT(trial.worst, bound) << v.name << " " << points << " points";
    worst = std::max(worst, trial.worst);
    worst_share_of_bound = std::max(worst_share_of_bound, trial.worst / bound);
    ++tables;
  }
  RecordProperty("worst_error_e9_of_base", static_cast<int>(1e9 * worst));
  EXPECT_GT(worst_share_of_bound, 0.1) << "the bound says nothing";
}

TEST(TableEffect, StandsFourTimesOnADrive) {
  Random random(1);
  const DriveConstants<double> drive = random_drive(random);
  std::vector<double> p(TableEffect::kParameters.size(), 0.0);
  for (std::size_t k = 0; k < p.size(); ++k) p[k] = TableEffect::kParameters[k].usual;
  model::DriveModel<Fixed> model;
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(model.add<TableEffect>(TableEffect::derive<Fixed>(p.data(), drive)));
  EXPECT_FALSE(model.add<TableEffect>(TableEffect::derive<Fixed>(p.data(), drive)));
}

TEST(SingleVariable, FindsTheSignalOfAnEffectThatATableCanHold) {
  const auto single = [](const std::string& name) {
    const catalogue::Entry& entry = catalogue::get(name);
    std::vector<double> usual;
    for (const auto& p : entry.parameters) usual.push_back(p.usual);
    return catalogue::single_variable(entry, usual, {});
  };
  EXPECT_EQ(single("viscous_friction")->variable, Variable::velocity);
  EXPECT_FALSE(single("viscous_friction")->times_direction);
  EXPECT_EQ(single("cubic_stiffness")->variable, Variable::torsion);
  EXPECT_EQ(single("torque_ripple")->variable, Variable::motor_angle);
  EXPECT_EQ(single("load_dependent_friction")->variable, Variable::torque);
  EXPECT_TRUE(single("load_dependent_friction")->times_direction);
  EXPECT_EQ(single("stribeck_gaussian")->variable, Variable::velocity);
  EXPECT_TRUE(single("stribeck_gaussian")->times_direction);
  const double amplitudes[] = {0.012, 0.02, 3.0};
  EXPECT_FALSE(catalogue::single_variable(catalogue::get("stribeck_gaussian"), amplitudes, {}))
      << "another amplitude in each direction: neither odd nor even";
  EXPECT_FALSE(single("dahl_friction").has_value());
  EXPECT_FALSE(single("load_scaled_ripple").has_value());
}

TEST(TorqueOver, SamplesAnEffectAlongOneSignal) {
  const std::vector<double> x{-2.0, 0.0, 1.0};
  const double stiffness[] = {3.0};
  EXPECT_EQ(catalogue::torque_over(catalogue::get("cubic_stiffness"), stiffness, {}, Variable::torsion, x),
            (std::vector<double>{-24.0, 0.0, 3.0}));
  const double mu[] = {0.05};
  DriveConstants<double> drive;
  drive.gear_ratio = 100.0;
  const auto torque =
      catalogue::torque_over(catalogue::get("load_dependent_friction"), mu, drive, Variable::torque, x, -1.0);
  EXPECT_NEAR(torque[0], -0.05 * 2.0 / 100.0, 1e-15);
}

}  // namespace
}  // namespace flexspline::tests::table_effect_test
