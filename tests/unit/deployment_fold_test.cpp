// Effects that an image lacks, and those that users make, on a drive: as tables.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/fold.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/control/drive_block.hpp"

namespace flexspline::tests::deployment_fold_test {
namespace {

using deployment::PackError;
using deployment::PackOptions;
using fixed::Fixed;

model::Model drive() {
  model::Model m;
  m.name = "some";
  m.drive.gear_ratio.value = 100.0;
  m.drive.torque_constant_nm_a.value = 0.05;
  m.drive.rated_current_a.value = 2.0;
  m.drive.rated_velocity_rad_s.value = 200.0;
  m.drive.rated_torque_nm.value = 40.0;
  return m;
}
model::Effect effect(const std::string& type) {
  const catalogue::Entry& entry = catalogue::get(type);
  model::Effect e = catalogue::blank_effect(entry, data::Axis::rotary);
  e.id = type;
  for (std::size_t p = 0; p < entry.parameters.size(); ++p) e.parameters[p].value = entry.parameters[p].usual;
  return e;
}
PackOptions options(double bound) {
  PackOptions o;
  o.samples = 2000;
  o.bound = bound;
  o.measured = true;  // what a fold is off is measured, not proven
  return o;
}
// The motor's torque, N m, at a velocity and its direction, as a drive computes it from a block.
double torque_of(const deployment::Packed& packed, double velocity, double current = 0.0) {
  const auto drive = std::make_unique<model::DriveModel<Fixed>>();
  EXPECT_TRUE(control::load(packed.bytes, *drive).good());
  const auto d = deployment::from_block(model::header_of(packed.bytes).bases);
  effects::Inputs<Fixed> in;
  in.velocity = Fixed::value(velocity / d.velocity_base);
  in.direction = Fixed::value(velocity < 0.0 ? -1.0 : velocity > 0.0 ? 1.0 : 0.0);
  in.current = Fixed::value(current / d.current_base);
  return std::ldexp(static_cast<double>(drive->tick(in).motor.raw), -fixed::kSumBits) * d.torque_base;
}

// Quadratic drag in closed form: c w abs(w); between two of 255 points over 800 rad/s a chord is off by c step^2/4.
TEST(Fold, OfAnEffectOfOneSignalIsItsTableWithTheErrorOfStraightLines) {
  model::Model m = drive();
  m.effects = {effect("viscous_friction"), effect("quadratic_drag")};
  const double c = *m.effects[1].parameters[0].value;
  PackOptions o = options(1e-3);
  o.image = {"viscous_friction", "table_effect"};
  const auto packed = deployment::pack(m, o);
  const double step = 800.0 / 254.0;
  double error = 0.0;
  for (const auto& part : packed.proof)
    if (part.kind == "interpolation") {
      EXPECT_EQ(part.part, "quadratic_drag");
      error = part.bound;
    }
  EXPECT_NEAR(error, c * step * step / 4.0, 0.05 * c * step * step);
  EXPECT_GT(packed.max_error_nm, 0.9 * error);
  for (const double w : {-390.0, -123.4, -1.0, 0.5, 77.0, 399.0})
    EXPECT_NEAR(torque_of(packed, w), 3.6e-4 * w + c * w * std::abs(w), error + 1e-8) << w;
}

TEST(Fold, IsRefusedWhereTheErrorIsAboveTheBoundOrTheEffectIsNoTable) {
  model::Model m = drive();
  m.effects = {effect("power_law_friction")};
  PackOptions o = options(1e-9);
  o.image = {"table_effect"};
  EXPECT_THROW(deployment::pack(m, o), deployment::BoundError);
  const auto reason = [&](const std::string& type, std::vector<std::string> image) -> std::string {
    m.effects = {effect(type)};
    o = options(1.0);
    o.image = std::move(image);
    try {
      deployment::pack(m, o);
    } catch (const PackError& error) {
      return error.what();
    }
    return "packed";
  };
  EXPECT_NE(reason("dahl_friction", {"table_effect"}).find("on what was before"), std::string::npos);
  EXPECT_NE(reason("load_scaled_ripple", {"table_effect"}).find("more than one signal"), std::string::npos);
  EXPECT_NE(reason("quadratic_drag", {"inertia"}).find("table_effect"), std::string::npos);
  EXPECT_EQ(reason("quadratic_drag", {"table_effect"}), "packed");
  EXPECT_EQ(reason("load_dependent_friction", {"table_effect"}), "packed");
}

TEST(Fold, OfATableOfTheModelIsThatTableAndComesBackFromTheBlock) {
  model::Model m = drive();
  model::Effect table;
  table.type = "table_effect";
  table.id = "bearing";
  table.definition.emplace();
  table.definition->variable = "velocity";
  table.definition->table.at = {-200.0, -100.0, 0.0, 100.0, 200.0};
  table.definition->table.value = {-0.03, -0.01, 0.0, 0.02, 0.05};
  m.effects = {effect("viscous_friction"), table};
  const auto packed = deployment::pack(m, options(1e-6));
  EXPECT_NEAR(torque_of(packed, 150.0), 3.6e-4 * 150.0 + 0.035, 1e-7);
  EXPECT_NEAR(torque_of(packed, -250.0), -3.6e-4 * 250.0 - 0.03, 1e-7);
  const auto back = deployment::unpack(packed.bytes);
  ASSERT_TRUE(back.model);
  EXPECT_TRUE(back.coefficients_follow);
  const model::Effect* again = back.model->find("bearing");
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->definition->table.value, table.definition->table.value);
  EXPECT_EQ(again->definition->table.at, table.definition->table.at);
  EXPECT_EQ(again->definition->variable, "velocity");
}

TEST(Fold, OfAFormulaOverOneSignalIsATableAndOverTwoIsNone) {
  model::Model m = drive();
  model::Effect formula;
  formula.type = "expression_effect";
  formula.id = "saturating";
  formula.definition = model::Definition{};
  formula.definition->balance = "motor";
  formula.definition->formula = "0.002 * current^3";
  m.effects = {formula};
  const auto packed = deployment::pack(m, options(1e-3));
  for (const double i : {-3.9, -1.0, 0.3, 2.5}) EXPECT_NEAR(torque_of(packed, 0.0, i), 0.002 * i * i * i, 1e-5) << i;
  m.effects[0].definition->formula = "0.002 * current * velocity";
  EXPECT_THROW(deployment::pack(m, options(1.0)), PackError);
}

}  // namespace
}  // namespace flexspline::tests::deployment_fold_test
