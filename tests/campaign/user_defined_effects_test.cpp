// Tables and formulas as `add`, `identify` and `diagnose` take them, on motions that are written down.
#include "host/engine/selection/user_defined_effects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "tests/support/plain_model.hpp"

namespace flexspline::selection::user_defined_effects_test {
namespace {

using data::Column;
using tests::plain_model;

constexpr double kPi = 3.14159265358979323846;
constexpr double kNoise = 2e-4;

// What a chipped tooth adds: at one angle of each turn, against the motion.
double tooth(double q, double w) {
  const double x = std::remainder(q - 2.0, 2.0 * kPi);
  return 0.02 * std::exp(-std::pow(x / 0.5, 2.0)) * (w > 0.0 ? 1.0 : -1.0);
}
double nothing(double, double) {
  return 0.0;
}

data::Dataset motions(const std::function<double(double q, double w)>& hidden, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  data::Dataset dataset;
  for (int record = 0; record < 3; ++record) {
    data::Experiment e;
    e.name = "r" + std::to_string(record);
    e.sample_s = 4e-3;
    e.current_hold = data::CurrentHold::none;
    e.role = record == 2 ? data::Role::holdout : data::Role::fit;
    for (int k = 0; k < 3000; ++k) {
      const double t = 4e-3 * k;
      double q = 0.0, w = 0.0, a = 0.0;
      for (const auto& [size, hz] : {std::pair{9.0 + 2.0 * record, 0.31}, {1.3, 0.9}, {0.2, 2.3}}) {
        const double rate = 2.0 * kPi * hz, angle = rate * t + 1.7 * record;
        q += size * std::sin(angle);
        w += size * rate * std::cos(angle);
        a -= size * rate * rate * std::sin(angle);
      }
      e.time_s.push_back(t);
      e[Column::motor_position].push_back(q);
      e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + (w > 0.0 ? 0.05 : -0.05) + hidden(q, w) +
                                        kNoise * normal(random));
    }
    e.noise_std[static_cast<std::size_t>(Column::motor_torque)] = kNoise;
    e.segments = {{0, 3000}};
    e.motor_position_zero = data::PositionZero::absolute;
    dataset.experiments.push_back(std::move(e));
  }
  return dataset;
}

const estimation::PipelineOptions kOptions{30.0, true};

std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(UserDefinedEffects, NamesAndParametersAreReadAsTheyAreWritten) {
  EXPECT_TRUE(names_user_defined_effect("table_effect:velocity"));
  EXPECT_TRUE(names_user_defined_effect("expression_effect"));
  EXPECT_FALSE(names_user_defined_effect("torque_ripple:2"));
  const model::Effect table = user_defined_effect("table_effect:torque*direction", {}, plain_model());
  EXPECT_EQ(table.definition->variable, "torque");
  EXPECT_TRUE(table.definition->times_direction);
  EXPECT_EQ(table.definition->balance, "motor");
  EXPECT_EQ(table.id, "table_torque_direction");
  EXPECT_EQ(user_defined_effect("table_effect:torsion", {}, plain_model()).definition->balance, "transmission");
  EXPECT_EQ(user_defined_effect("table_effect:output_velocity", {}, plain_model()).definition->balance, "load");
  const model::Parameter b = parse_parameter("b=0.1..50:rad/s");
  EXPECT_EQ(b.name, "b");
  EXPECT_EQ(b.unit, "rad/s");
  EXPECT_EQ(b.low, 0.1);
  EXPECT_EQ(b.high, 50.0);
  EXPECT_EQ(parse_parameter("a:N*m").unit, "N*m");
  EXPECT_EQ(parse_parameter("c=0..").low, 0.0);
  EXPECT_FALSE(parse_parameter("c=0..").high);
  EXPECT_EQ(parse_parameter("c").unit, "1");
}

TEST(UserDefinedEffects, MistakesAreSaidWithWhatIsKnown) {
  const auto mistake_in = [](const char* text, const UserDefinition& m = {}) {
    return error_of([&] { user_defined_effect(text, m, plain_model()); });
  };
  EXPECT_NE(mistake_in("table_effect").find("write table_effect:velocity, for example; signals are velocity, speed"),
            std::string::npos);
  EXPECT_EQ(mistake_in("table_effect:velocty"), "there is no signal \"velocty\"; did you mean velocity?");
  EXPECT_NE(mistake_in("expression_effect").find("needs --formula"), std::string::npos);
  UserDefinition m;
  m.formula = "a*velocty";
  m.parameters = {"a:N*m"};
  EXPECT_NE(mistake_in("expression_effect", m).find("did you mean velocity?"), std::string::npos);
  m.formula = "a*velocity";
  m.parameters = {"a:N*m", "a:N"};
  EXPECT_EQ(mistake_in("expression_effect", m), "the parameter a is given twice");
  m.parameters = {"a=1:N*m"};
  EXPECT_NE(mistake_in("expression_effect", m).find("two dots"), std::string::npos);
  m.balance = "engine";
  EXPECT_EQ(mistake_in("expression_effect", m), "there is no balance \"engine\"; it is motor, transmission or load");
  UserDefinition points;
  points.points = 300;
  EXPECT_EQ(mistake_in("table_effect:velocity", points), "300 points are too many; a table has 4 to 256");
}

TEST(AddTable, LearnsACurveThatHoldsOnDataThatTheFitNeverSaw) {
  const Addition added = add(motions(tooth), plain_model(), "table_effect:motor_angle*direction", kOptions);
  ASSERT_EQ(added.tables.size(), 1U);
  EXPECT_GT(*added.before.rmse_holdout, 10.0 * *added.after.rmse_holdout);
  ASSERT_TRUE(added.noise_floor);
  EXPECT_LT(*added.after.rmse_holdout, 2.0 * *added.noise_floor);
  const model::Effect& effect = *added.model.find("table_motor_angle_direction");
  const model::Table& table = effect.definition->table;
  EXPECT_LE(table.at.size(), 256U);
  ASSERT_EQ(table.std.size(), table.at.size());
  // Coulomb friction holds the mean of what depends on the direction: the curve is the tooth less a constant.
  EXPECT_EQ(added.tables[0].second.left_to, std::vector<std::string>{"coulomb_friction"});
  double coulomb = 0.0;
  for (const auto& e : added.estimates)
    if (e.id == "coulomb_friction") coulomb = e.value;
  double worst = 0.0;
  for (std::size_t k = 0; k < table.at.size(); ++k)
    worst = std::max(worst, std::abs(table.value[k] + coulomb - 0.05 - tooth(table.at[k], 1.0)));
  EXPECT_LT(worst, 1e-3) << "a twentieth of the bump";
  EXPECT_EQ(added.model.history.back().effect, "table_effect:motor_angle*direction");
  // Taken out again, by its label.
  const Addition removed = remove(motions(tooth), added.model, "table_effect:motor_angle*direction", kOptions);
  EXPECT_NEAR(*removed.after.rmse_holdout, *added.before.rmse_holdout, 1e-9);
}

TEST(AddTable, RefusesWhereNothingDependsOnTheSignal) {
  const data::Dataset plain = motions(nothing);
  for (const char* effect :
       {"table_effect:motor_angle", "table_effect:motor_angle*direction", "table_effect:velocity"}) {
    const std::string error = error_of([&] { add(plain, plain_model(), effect, kOptions); });
    EXPECT_NE(error.find("hardly lowers the error on samples that its fit did not see"), std::string::npos)
        << effect << ": " << error;
  }
  EXPECT_NE(error_of([&] { add(plain, plain_model(), "table_effect:temperature", kOptions); }).find("does not vary"),
            std::string::npos);
}

TEST(IdentifyTable, LearnsItsValuesAnewUnlessTheyAreFixed) {
  const Addition added = add(motions(tooth), plain_model(), "table_effect:motor_angle*direction", kOptions);
  model::Model moved = added.model;
  model::Table& table = moved.find("table_motor_angle_direction")->definition->table;
  const std::vector<double> before = table.value;
  for (double& v : table.value) v *= 0.5;
  const auto again = estimation::identify(motions(tooth), moved, kOptions);
  const model::Table& learned = again->model.find("table_motor_angle_direction")->definition->table;
  EXPECT_EQ(learned.at, table.at) << "the points stay";
  for (std::size_t k = 0; k < before.size(); ++k) EXPECT_NEAR(learned.value[k], before[k], 1e-4);
  table.fixed = true;
  const auto held = estimation::identify(motions(tooth), moved, kOptions);
  EXPECT_EQ(held->model.find("table_motor_angle_direction")->definition->table.value, table.value);
  EXPECT_GT(held->fits[0].rmse(), 3.0 * again->fits[0].rmse());
}

TEST(AddExpression, EstimatesTheParametersOfAFormula) {
  UserDefinition given;
  given.formula = "height*exp(-(min(abs(motor_angle - 2), 2*pi - abs(motor_angle - 2))/width)^2)*direction";
  given.parameters = {"height:N*m", "width=0.05..3:rad"};
  const Addition added = add(motions(tooth), plain_model(), "expression_effect", kOptions, given);
  EXPECT_GT(*added.before.rmse_holdout, 10.0 * *added.after.rmse_holdout);
  const auto value = [&](const char* parameter) -> const estimation::Estimate& {
    for (const auto& e : added.estimates)
      if (e.id == "expression_effect" && e.parameter == parameter) return e;
    throw std::out_of_range(parameter);
  };
  EXPECT_NEAR(value("height").value, 0.02, 2e-4);
  EXPECT_NEAR(value("width").value, 0.5, 5e-3);
  EXPECT_EQ(value("width").unit, "rad");
  EXPECT_GT(*value("width").std, 0.0);
}

TEST(DiagnoseUnknown, SaysOverWhichSignalAndWithWhichCurve) {
  const Diagnosis d = diagnose(motions(tooth), plain_model(), {kOptions, {}});
  EXPECT_EQ(d.verdict, Verdict::unknown_structure);
  EXPECT_TRUE(d.named.empty());
  ASSERT_TRUE(d.unknown);
  EXPECT_EQ(d.unknown->effect, "table_effect:motor_angle*direction");
  EXPECT_GT(d.unknown->curve.decrease_percent, 90.0);
  EXPECT_EQ(d.unknown->depends_on.front().variable, "motor_angle*direction");
  EXPECT_NE(d.unknown->record_next.find("slow motion back and forth over motor_angle"), std::string::npos);
}

TEST(DiagnoseUnknown, SaysNothingWhereNothingIsMissing) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Diagnosis d = diagnose(motions(nothing, seed), plain_model(), {kOptions, {}});
    EXPECT_FALSE(d.unknown) << d.unknown->effect;
    EXPECT_NE(d.verdict, Verdict::unknown_structure);
  }
}

TEST(DiagnoseUnknown, LeavesAnEffectOfTheCatalogueItsName) {
  const auto ripple = [](double q, double) { return 0.004 * std::cos(3.0 * q + 0.5); };
  const Diagnosis d = diagnose(motions(ripple), plain_model(), {kOptions, {}});
  ASSERT_EQ(d.verdict, Verdict::missing_effect);
  EXPECT_EQ(d.named.front().effect, "torque_ripple");
  EXPECT_FALSE(d.unknown);
}

}  // namespace
}  // namespace flexspline::selection::user_defined_effects_test
