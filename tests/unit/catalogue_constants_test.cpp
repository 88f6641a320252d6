#include "host/catalogue/constants.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexspline::catalogue {
namespace {

TEST(DriveConstants, WhatTheModelDoesNotStateChangesNothing) {
  const auto c = constants_of(model::Drive{});
  EXPECT_EQ(c.gear_ratio, 1.0);
  EXPECT_EQ(c.torque_constant, 1.0);
  EXPECT_EQ(c.rated_velocity, 1.0);
  EXPECT_EQ(c.reference_temperature, 30.0);
  EXPECT_EQ(c.turn_angle_scale, 1.0);
}

TEST(DriveConstants, AreTheModelsInSiUnitsWithAllBasesOne) {
  model::Drive drive;
  drive.gear_ratio.value = 100.0;
  drive.torque_constant_nm_a.value = 0.04;
  drive.rated_velocity_rad_s.value = 200.0;
  drive.temperature_reference_c.value = 25.0;
  const auto c = constants_of(drive);
  EXPECT_EQ(c.gear_ratio, 100.0);
  EXPECT_EQ(c.torque_constant, 0.04);
  EXPECT_EQ(c.rated_velocity, 200.0);
  EXPECT_EQ(c.reference_temperature, 25.0);
  for (const double base :
       {c.torque_base, c.output_torque_base, c.velocity_base, c.output_velocity_base, c.acceleration_base,
        c.output_acceleration_base, c.angle_base, c.torsion_base, c.torsion_rate_base, c.temperature_base})
    EXPECT_EQ(base, 1.0);
}

TEST(DriveConstants, APitchTurnsTravelIntoTurnsOnALinearAxisOnly) {
  model::Drive drive;
  drive.pitch_m.value = 0.005;
  EXPECT_EQ(constants_of(drive).turn_angle_scale, 1.0);
  drive.axis = data::Axis::linear;
  EXPECT_NEAR(constants_of(drive).turn_angle_scale * 0.005, 2.0 * std::acos(-1.0), 1e-14) << "one pitch is one turn";
}

TEST(KnownEffects, SayOfEachEffectWhatTheCatalogueSays) {
  const model::KnownEffects& known = known_effects();
  ASSERT_EQ(known.names().size(), all().size());
  for (const Entry& entry : all()) {
    const model::KnownEffect* effect = known.find(entry.name());
    ASSERT_NE(effect, nullptr) << entry.name();
    ASSERT_EQ(effect->parameters.size(), entry.parameters.size()) << entry.name();
    for (std::size_t p = 0; p < entry.parameters.size(); ++p) {
      EXPECT_EQ(effect->parameters[p].name, entry.parameters[p].name);
      // Bounds of a ratio or a root are none of the parameter itself, whose sign they tell.
      const bool own = entry.parameters[p].per.empty() && entry.parameters[p].root_of.empty();
      if (own) {
        EXPECT_EQ(effect->parameters[p].low, entry.parameters[p].low);
        EXPECT_EQ(effect->parameters[p].high, entry.parameters[p].high);
      } else {
        EXPECT_EQ(effect->parameters[p].low, entry.parameters[p].low >= 0.0 ? 0.0 : -effects::kUnbounded);
        EXPECT_EQ(effect->parameters[p].high, effects::kUnbounded);
      }
    }
  }
  EXPECT_EQ(known.find("viscous_fricton"), nullptr);
  ASSERT_NE(known.find("torque_ripple"), nullptr);
  EXPECT_TRUE(known.find("torque_ripple")->parameters[0].given) << "the order is never estimated";
  EXPECT_FALSE(known.find("torque_ripple")->parameters[1].given);
  EXPECT_EQ(known.find("viscous_friction")->parameters[0].unit_rotary, "N*m*s/rad");
  EXPECT_EQ(known.find("viscous_friction")->parameters[0].unit_linear, "N*s/m");
}

TEST(BlankEffect, HasAllParametersInTheAxisUnitsAndNoValues) {
  const model::Effect rotary = blank_effect(get("stribeck_gaussian"), data::Axis::rotary);
  EXPECT_EQ(rotary.type, "stribeck_gaussian");
  EXPECT_EQ(rotary.id, "stribeck_gaussian");
  ASSERT_EQ(rotary.parameters.size(), 3u);
  for (const model::Parameter& p : rotary.parameters) {
    EXPECT_FALSE(p.value) << p.name;
    EXPECT_FALSE(p.fixed) << p.name;
  }
  EXPECT_EQ(rotary.parameters[0].unit, "N*m");
  EXPECT_EQ(rotary.parameters[2].unit, "rad/s");
  const model::Effect linear = blank_effect(get("stribeck_gaussian"), data::Axis::linear);
  EXPECT_EQ(linear.parameters[0].unit, "N");
  EXPECT_EQ(linear.parameters[2].unit, "m/s");
}

TEST(BlankEffect, AnOrderIsFixed) {
  const model::Effect ripple = blank_effect(get("torque_ripple"), data::Axis::rotary);
  EXPECT_TRUE(ripple.find("order")->fixed);
  EXPECT_FALSE(ripple.find("cosine")->fixed);
}

TEST(ValuesOf, AreInTheOrderOfTheCatalogueWhateverThatOfTheModel) {
  const Entry& entry = get("stribeck_gaussian");
  model::Effect effect = blank_effect(entry, data::Axis::rotary);
  effect.find("velocity")->value = 3.0;
  effect.find("amplitude_positive")->value = 0.012;
  std::swap(effect.parameters[0], effect.parameters[2]);
  EXPECT_EQ(values_of(effect, entry), (std::vector<double>{0.012, 0.0, 3.0})) << "nought where there is no value";
  effect.parameters.clear();
  EXPECT_EQ(values_of(effect, entry), (std::vector<double>{0.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace flexspline::catalogue
