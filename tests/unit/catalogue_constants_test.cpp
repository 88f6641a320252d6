#include "host/physics/catalogue/constants.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::catalogue::catalogue_constants_test {
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
  for (const double base : {c.torque_base, c.output_torque_base, c.velocity_base, c.output_velocity_base,
                            c.acceleration_base, c.output_acceleration_base, c.angle_base, c.torsion_base,
                            c.torsion_rate_base, c.temperature_base, c.current_base, c.time_base})
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
  // A table and a formula are of the user's making: each has an entry of its own, and only their names are known.
  ASSERT_EQ(known.names().size(), all().size() + 2);
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

// A ratio is bounded where it is searched for; what a file states may be any that has the sign of the bound.
TEST(KnownEffects, AModelFileMayHoldAnyPositiveStiffnessWhereTheBoundIsThatOfARatio) {
  const auto text = [](const std::string& effect, const std::string& parameters) {
    return "format = \"flexspline-model/1\"\n[[effect]]\ntype = \"" + effect + "\"\n[effect.parameters]\n" + parameters;
  };
  const auto reads = [&](const std::string& effect, const std::string& parameters) {
    try {
      return model::parse(text(effect, parameters), "m.toml", known_effects()).model.effects.size() == 1U;
    } catch (const model::ModelError&) {
      return false;
    }
  };
  for (const char* stiffness : {"1e-12", "0.0", "5e3", "9e15"}) {
    EXPECT_TRUE(reads("dahl_hysteresis", std::string("torque = 2\nexponent = 1\nstiffness = ") + stiffness + "\n"));
    EXPECT_TRUE(reads("piecewise_stiffness", std::string("stiffness_1 = 4000\nstiffness_3 = ") + stiffness + "\n"));
    EXPECT_TRUE(reads("lugre_friction", std::string("coulomb = 0.04\nstatic = ") + stiffness + "\n"));
  }
  // Bouc-Wen's gamma over beta is searched for from -0.5 to 1, its beta as a root.
  EXPECT_TRUE(reads("bouc_wen_hysteresis", "beta = 1e12\ngamma = -4e11\n"));
  EXPECT_FALSE(reads("dahl_hysteresis", "torque = 2\nstiffness = -1\n"));
  EXPECT_FALSE(reads("bouc_wen_hysteresis", "beta = -1\n"));
  EXPECT_FALSE(reads("dahl_hysteresis", "exponent = 9\n")) << "this bound is that of the parameter itself";
}

std::vector<double> usual_values(const Entry& entry) {
  std::vector<double> usual;
  for (const auto& info : entry.parameters) usual.push_back(info.usual);
  return usual;
}

TEST(ReducedParameters, AreRatiosAndRootsAndComeBackToTheNaturalValues) {
  const Entry& bouc_wen = get("bouc_wen_hysteresis");
  const std::vector<double> values = {5000.0, 4e6, 2e6, 2.0};
  const std::vector<double> searched = reduced(bouc_wen, values);
  EXPECT_EQ(searched[0], 5000.0);
  EXPECT_DOUBLE_EQ(searched[1], 2000.0) << "the square root";
  EXPECT_DOUBLE_EQ(searched[2], 0.5);
  EXPECT_EQ(natural(bouc_wen, searched), values);
  const Entry& piecewise = get("piecewise_stiffness");
  const std::vector<double> slopes = reduced(piecewise, {4000.0, 6000.0, 8000.0, 3.0, 7.5});
  EXPECT_DOUBLE_EQ(slopes[1], 1.5);
  EXPECT_DOUBLE_EQ(slopes[3], 3.0 / 4000.0) << "the torsion at the corner";
  EXPECT_DOUBLE_EQ(slopes[4], 2.5) << "per torque_1 as it is, not as it is searched for";
  for (const Entry& entry : all()) {
    std::vector<double> usual = usual_values(entry);
    for (double& value : usual) value *= 1.7;
    const std::vector<double> back = natural(entry, reduced(entry, usual));
    for (std::size_t p = 0; p < usual.size(); ++p)
      EXPECT_NEAR(back[p], usual[p], 1e-12 * std::abs(usual[p])) << entry.name() << "." << entry.parameters[p].name;
  }
}

TEST(ReducedParameters, OfDualNumbersHaveTheDerivativesOfTheNaturalOnes) {
  const Entry& bouc_wen = get("bouc_wen_hysteresis");
  const std::vector<double> searched = {5000.0, 2000.0, 0.5, 1.5};
  for (std::size_t which = 0; which < searched.size(); ++which) {
    std::vector<numbers::Jet> seeded(searched.begin(), searched.end());
    seeded[which].v[0] = 1.0;
    const std::vector<numbers::Jet> dual = natural(bouc_wen, seeded);
    const double step = 1e-6 * searched[which];
    std::vector<double> above = searched, below = searched;
    above[which] += step;
    below[which] -= step;
    const std::vector<double> high = natural(bouc_wen, above), low = natural(bouc_wen, below);
    for (std::size_t p = 0; p < searched.size(); ++p) {
      const double slope = (high[p] - low[p]) / (2.0 * step);
      EXPECT_NEAR(dual[p].v[0], slope, 1e-7 * std::abs(slope) + 1e-9) << p << " by " << which;
    }
  }
}

// A model may switch an effect off, and a search begins with zero: what others are stated per, and what coefficients
// divide by, may be zero then.
TEST(ReducedParameters, APivotOfZeroStaysFinite) {
  for (const Entry& entry : all()) {
    SCOPED_TRACE(entry.name());
    for (const double value : reduced(entry, std::vector<double>(entry.parameters.size(), 0.0)))
      EXPECT_TRUE(std::isfinite(value));
    if (!entry.adds_torque()) continue;
    std::vector<effects::Inputs<Real>> inputs(20);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      auto& in = inputs[k];
      in.elapsed = 1e-3;
      in.viscous_scale = in.coulomb_scale = in.direction = in.torsion_direction = 1.0;
      if (k < 5) continue;  // begins at rest
      const double x = static_cast<double>(k % 12) - 6.0;
      in.angle = in.velocity = in.current = in.torque = x;
      in.speed = in.torque_magnitude = std::abs(x);
      in.torsion = in.torsion_rate = 1e-3 * x;
    }
    std::vector<double> off = usual_values(entry);
    for (std::size_t p = 0; p < off.size(); ++p)
      if (entry.parameters[p].kind == Kind::linear) off[p] = 0.0;
    const std::vector<double> zero(off.size(), 0.0);
    for (const std::vector<double>& parameters : {natural(entry, reduced(entry, off)), zero}) {
      std::vector<double> torque(inputs.size(), 0.0);
      std::vector<numbers::Jet> dual(inputs.size(), numbers::Jet(0.0));
      const std::vector<numbers::Jet> lifted_parameters(parameters.begin(), parameters.end());
      entry.real.torque(parameters.data(), {}, entry.identified_on(), inputs, torque.data());
      entry.dual.torque_of_plain(lifted_parameters.data(), {}, entry.identified_on(), inputs, dual.data());
      for (std::size_t k = 0; k < inputs.size(); ++k) {
        EXPECT_TRUE(std::isfinite(torque[k]) && std::isfinite(dual[k].a) && std::isfinite(dual[k].v[0])) << k;
        // With all linear parameters at zero nothing is left of what has some, to far below any rounding.
        EXPECT_NEAR(torque[k], 0.0, entry.count(Kind::linear) > 0 ? 1e-25 : effects::kUnbounded);
      }
    }
  }
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
  EXPECT_EQ(values_of(effect, entry), (std::vector<double>{0.012, 0.0, 3.0})) << "zero where there is no value";
  effect.parameters.clear();
  EXPECT_EQ(values_of(effect, entry), (std::vector<double>{0.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace flexspline::catalogue::catalogue_constants_test
