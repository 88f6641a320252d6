// The catalogue: what users, model files and parameter blocks rely on stands as the published list of effects says, and
// an effect is one file and one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host/catalogue/catalogue.hpp"

namespace flexspline::tests {
namespace {

namespace fs = std::filesystem;
using catalogue::Balance;
using catalogue::Entry;
using catalogue::Kind;
using catalogue::Phase;
using effects::Limit;

struct Published {
  struct Parameter {
    std::string_view name;
    std::string_view unit;
    Kind kind;
    double usual;
    double usual_to;  // the end of a range, or as `usual`
  };
  std::string_view name;
  std::size_t id;  // in the parameter block: never changed, never given again
  Balance balance;
  Phase phase;
  std::vector<Parameter> parameters;
};

const std::vector<Published>& published() {
  using enum Balance;
  using enum Phase;
  using enum Kind;
  static std::vector<Published> list = {
      {"inertia", 1, motor, source, {{"inertia", "kg*m^2", linear, 1e-4, 1e-4}}},
      {"viscous_friction", 2, motor, source, {{"coefficient", "N*m*s/rad", linear, 3.6e-4, 3.6e-4}}},
      {"coulomb_friction", 3, motor, source, {{"torque", "N*m", linear, 0.045, 0.045}}},
      {"viscous_asymmetry", 4, motor, source, {{"coefficient", "N*m*s/rad", linear, 1e-5, 1e-4}}},
      {"coulomb_asymmetry", 5, motor, source, {{"torque", "N*m", linear, 1e-3, 6e-3}}},
      {"stribeck_gaussian",
       6,
       motor,
       source,
       {{"amplitude_positive", "N*m", linear, 0.012, 0.012},
        {"amplitude_negative", "N*m", linear, 0.012, 0.012},
        {"velocity", "rad/s", shape, 3.0, 3.0}}},
      {"power_law_friction",
       7,
       motor,
       source,
       {{"torque", "N*m", linear, 0.02, 0.02}, {"exponent", "1", shape, 0.4, 0.7}}},
      {"load_dependent_friction", 8, motor, source, {{"coefficient", "1", linear, 0.03, 0.08}}},
      {"temperature_viscous", 9, motor, modulate, {{"coefficient", "1/degC", shape, 0.012, 0.012}}},
      {"dahl_friction",
       10,
       motor,
       source,
       {{"torque", "N*m", linear, 0.045, 0.045}, {"presliding", "rad", shape, 0.05, 0.05}}},
      {"torque_ripple",
       11,
       motor,
       source,
       {{"order", "1", given, 2.0, 4.0}, {"cosine", "N*m", linear, 0.004, 0.004}, {"sine", "N*m", linear, 0.0, 0.004}}},
      {"current_offset", 12, motor, source, {{"current", "A", linear, 0.05, 0.05}}},
      {"torque_bias", 13, motor, source, {{"torque", "N*m", linear, 0.0, 0.045}}},  // no size published
      {"linear_stiffness", 14, transmission, source, {{"stiffness", "N*m/rad", linear, 6.3e3, 6.3e3}}},
      {"structural_damping",
       15,
       transmission,
       source,
       {{"torque", "N*m", linear, 57.0, 57.0}, {"exponent", "1", shape, 0.5, 0.5}}},
      {"backlash", 16, transmission, shift, {{"half_width", "rad", shape, 1.5e-4, 1.5e-4}}},
      {"output_inertia", 17, load, source, {{"inertia", "kg*m^2", linear, 0.06, 0.06}}},
      {"output_viscous_friction", 18, load, source, {{"coefficient", "N*m*s/rad", linear, 0.5, 0.5}}},
      {"output_coulomb_friction", 19, load, source, {{"torque", "N*m", linear, 0.6, 0.6}}},
      {"gravity", 20, load, source, {{"cosine", "N*m", linear, 0.0, 3.0}, {"sine", "N*m", linear, 3.0, 3.0}}},
      {"quadratic_drag", 21, motor, source, {{"coefficient", "N*m*s^2/rad^2", linear, 4e-7, 4e-7}}},
      {"stribeck_hess_soom",
       22,
       motor,
       source,
       {{"amplitude_positive", "N*m", linear, 0.012, 0.012},
        {"amplitude_negative", "N*m", linear, 0.012, 0.012},
        {"velocity", "rad/s", shape, 3.0, 3.0}}},
      {"temperature_coulomb", 23, motor, modulate, {{"coefficient", "1/degC", shape, 0.005, 0.005}}},
      {"lugre_friction",
       24,
       motor,
       source,
       {{"coulomb", "N*m", linear, 0.045, 0.045},
        {"static", "N*m", shape, 0.055, 0.055},
        {"velocity", "rad/s", shape, 3.0, 3.0},
        {"stiffness", "N*m/rad", shape, 0.4, 0.4},
        {"damping", "N*m*s/rad", shape, 1e-4, 1e-4}}},
      {"load_scaled_ripple",
       25,
       motor,
       source,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "1", linear, 5e-4, 5e-4}, {"sine", "1", linear, 0.0, 5e-4}}},
      {"torque_constant_error", 26, motor, source, {{"ratio", "1", linear, 0.2, 0.2}}},
      {"torque_constant_saturation", 27, motor, source, {{"coefficient", "1/A^2", linear, 5e-4, 1e-2}}},
      {"current_saturation", 28, motor, source, {{"limit", "A", shape, 0.1, 100.0}}},
      {"current_delay", 29, motor, source, {{"delay", "s", shape, 1e-3, 1e-3}}},
      {"quadratic_stiffness", 30, transmission, source, {{"stiffness", "N*m/rad^2", linear, 1e3, 1e7}}},
      {"cubic_stiffness", 31, transmission, source, {{"stiffness", "N*m/rad^3", linear, 3e8, 3e8}}},
      {"piecewise_stiffness",
       32,
       transmission,
       source,
       {{"stiffness_1", "N*m/rad", linear, 4725.0, 4725.0},
        {"stiffness_2", "N*m/rad", shape, 6300.0, 6300.0},
        {"stiffness_3", "N*m/rad", shape, 7875.0, 7875.0},
        {"torque_1", "N*m", shape, 3.0, 3.0},
        {"torque_2", "N*m", shape, 7.0, 7.0}}},
      {"dahl_hysteresis",
       33,
       transmission,
       source,
       {{"torque", "N*m", linear, 2.0, 2.0},
        {"stiffness", "N*m/rad", shape, 5000.0, 5000.0},
        {"exponent", "1", shape, 1.0, 1.0}}},
      {"modified_dahl_hysteresis",
       34,
       transmission,
       source,
       {{"torque", "N*m", linear, 0.1, 10.0}, {"stiffness", "N*m/rad", shape, 1e2, 1e5}}},
      {"duhem_hysteresis",
       35,
       transmission,
       source,
       {{"rate", "1/rad", shape, 1e2, 1e5},
        {"stiffness", "N*m/rad", linear, 1e3, 1e5},
        {"phi_0", "N*m", linear, 0.0, 1.0},
        {"phi_1", "N*m/rad", linear, 1e3, 1e5},
        {"phi_2", "N*m/rad^2", linear, 0.0, 1e7},
        {"phi_3", "N*m/rad^3", linear, 0.0, 1e9}}},
      {"bouc_wen_hysteresis",
       36,
       transmission,
       source,
       {{"stiffness", "N*m/rad", linear, 1e3, 1e5},
        {"beta", "1", shape, 1e2, 1e5},
        {"gamma", "1", shape, 0.0, 1e5},
        {"exponent", "1", shape, 1.0, 3.0}}},
      {"torque_proportional_hysteresis",
       39,
       transmission,
       source,
       {{"torque", "N*m", linear, 0.5, 0.5},
        {"ratio", "1", shape, 0.05, 0.05},
        {"stiffness", "N*m/rad", shape, 1e2, 1e5}}},
      {"kinematic_error",
       40,
       transmission,
       shift,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "rad", shape, 4e-5, 4e-5}, {"sine", "rad", shape, 0.0, 4e-5}}},
      {"torque_offset", 41, transmission, source, {{"torque", "N*m", linear, 0.2, 0.2}}},
      {"torque_sensor_gain", 42, transmission, source, {{"ratio", "1", shape, 0.03, 0.03}}},
      {"torque_sensor_ripple",
       43,
       transmission,
       source,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "N*m", linear, 0.3, 0.3}, {"sine", "N*m", linear, 0.0, 0.3}}},
      {"torsion_zero", 44, transmission, shift, {{"angle", "rad", shape, 1e-4, 1e-4}}},
  };
  // Laws of many operators: their keys are counted.
  const auto counted = [](std::string_view name, std::size_t id, std::vector<Published::Parameter> parameters) {
    list.push_back({name, id, transmission, source, std::move(parameters)});
  };
  if (list.back().name == "torsion_zero") {
    static std::vector<std::string> keys;
    for (int j = 1; j <= 8; ++j) keys.push_back("threshold_" + std::to_string(j));
    for (int j = 1; j <= 8; ++j) keys.push_back("weight_" + std::to_string(j));
    for (int j = 1; j <= 9; ++j)
      for (int k = 1; k <= j; ++k) keys.push_back("weight_" + std::to_string(j) + std::to_string(k));
    std::vector<Published::Parameter> plays, relays{{"span", "rad", shape, 1e-5, 1e-2}};
    for (std::size_t j = 0; j < 8; ++j) plays.push_back({keys[j], "rad", grid, 1e-6, 1e-2});
    for (std::size_t j = 8; j < 16; ++j) plays.push_back({keys[j], "N*m/rad", linear, -1e5, 1e5});
    for (std::size_t j = 16; j < keys.size(); ++j) relays.push_back({keys[j], "N*m", linear, -10.0, 10.0});
    counted("prandtl_ishlinskii_hysteresis", 37, plays);
    counted("preisach_hysteresis", 38, relays);
  }
  return list;
}

// Every name of the published list, built or not: what descriptions may refer to.
const std::set<std::string_view> kPublishedNames = {"inertia",
                                                    "viscous_friction",
                                                    "coulomb_friction",
                                                    "viscous_asymmetry",
                                                    "coulomb_asymmetry",
                                                    "stribeck_gaussian",
                                                    "stribeck_hess_soom",
                                                    "power_law_friction",
                                                    "quadratic_drag",
                                                    "load_dependent_friction",
                                                    "temperature_viscous",
                                                    "temperature_coulomb",
                                                    "dahl_friction",
                                                    "lugre_friction",
                                                    "torque_ripple",
                                                    "load_scaled_ripple",
                                                    "current_offset",
                                                    "torque_bias",
                                                    "torque_constant_error",
                                                    "torque_constant_saturation",
                                                    "current_saturation",
                                                    "current_delay",
                                                    "linear_stiffness",
                                                    "quadratic_stiffness",
                                                    "cubic_stiffness",
                                                    "piecewise_stiffness",
                                                    "structural_damping",
                                                    "dahl_hysteresis",
                                                    "modified_dahl_hysteresis",
                                                    "duhem_hysteresis",
                                                    "bouc_wen_hysteresis",
                                                    "prandtl_ishlinskii_hysteresis",
                                                    "preisach_hysteresis",
                                                    "torque_proportional_hysteresis",
                                                    "kinematic_error",
                                                    "backlash",
                                                    "torque_offset",
                                                    "torque_sensor_gain",
                                                    "torque_sensor_ripple",
                                                    "torsion_zero",
                                                    "output_inertia",
                                                    "output_viscous_friction",
                                                    "output_coulomb_friction",
                                                    "gravity",
                                                    "table_effect",
                                                    "expression_effect"};

TEST(Catalogue, HasEveryPublishedEffectWithItsNumberKeysUnitsAndUsualSizes) {
  for (const Published& expected : published()) {
    SCOPED_TRACE(expected.name);
    const Entry* entry = catalogue::find(expected.name);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->id, expected.id);
    EXPECT_EQ(entry->info->balance, expected.balance);
    EXPECT_EQ(entry->info->phase, expected.phase);
    ASSERT_EQ(entry->parameters.size(), expected.parameters.size());
    for (std::size_t k = 0; k < expected.parameters.size(); ++k) {
      const auto& parameter = entry->parameters[k];
      SCOPED_TRACE(parameter.name);
      EXPECT_EQ(parameter.name, expected.parameters[k].name);
      EXPECT_EQ(parameter.unit.rotary, expected.parameters[k].unit);
      EXPECT_EQ(parameter.kind, expected.parameters[k].kind);
      EXPECT_GE(parameter.usual, expected.parameters[k].usual);
      EXPECT_LE(parameter.usual, expected.parameters[k].usual_to);
      EXPECT_EQ(entry->index_of(parameter.name), k);
    }
  }
}

TEST(Catalogue, NamesAndNumbersAreUniqueAndRising) {
  std::set<std::string_view> names;
  std::size_t last = 0;
  for (const Entry& entry : catalogue::all()) {
    EXPECT_TRUE(names.insert(entry.name()).second) << entry.name() << " stands twice";
    EXPECT_TRUE(kPublishedNames.contains(entry.name())) << entry.name() << " is not in the published list";
    EXPECT_GT(entry.id, last);
    EXPECT_LE(entry.id, effects::kLastId);
    last = entry.id;
    std::set<std::string_view> keys;
    for (const auto& parameter : entry.parameters) EXPECT_TRUE(keys.insert(parameter.name).second);
  }
  EXPECT_EQ(names.size(), published().size());
  // What a user makes himself is not an effect of the list: tables and formulas.
  EXPECT_EQ(names.size() + 2, kPublishedNames.size());
}

TEST(Catalogue, DescribesEachEffectToSomebodyWhoNeverHeardOfIt) {
  for (const Entry& entry : catalogue::all()) {
    SCOPED_TRACE(entry.name());
    const effects::Description& info = *entry.info;
    for (const std::string_view text :
         {info.explanation, info.causes, info.equation, info.source, info.shows_over, info.separated_by})
      EXPECT_FALSE(text.empty());
    for (const std::string_view sentence : {info.explanation, info.causes}) {
      EXPECT_GT(sentence.size(), 40U);
      EXPECT_TRUE(sentence.ends_with('.'));
    }
    EXPECT_NE(info.reads, 0U);
    for (const std::string_view list : {info.rivals, info.replaces, info.modulates})
      for (const std::string_view name : catalogue::split_names(list)) {
        EXPECT_TRUE(kPublishedNames.contains(name)) << '"' << name << '"';
        EXPECT_NE(name, entry.name());
      }
    EXPECT_FALSE(info.rivals.empty());
    if (info.phase == Phase::modulate)
      EXPECT_NE(catalogue::find(info.modulates), nullptr) << "what it scales must be there to be scaled";
    else
      EXPECT_TRUE(info.modulates.empty());
  }
}

TEST(Catalogue, BoundsHoldTheUsualValueAndShapesAreBounded) {
  for (const Entry& entry : catalogue::all()) {
    std::vector<double> usual;
    for (const auto& parameter : entry.parameters) usual.push_back(parameter.usual);
    const std::vector<double> reduced = catalogue::reduced(entry, usual);
    for (std::size_t p = 0; p < reduced.size(); ++p) {
      const auto& parameter = entry.parameters[p];
      SCOPED_TRACE(std::string(entry.name()) + "." + std::string(parameter.name));
      EXPECT_TRUE(std::isfinite(parameter.usual));
      EXPECT_LT(parameter.low, parameter.high);
      EXPECT_LE(parameter.low, reduced[p]);
      EXPECT_GE(parameter.high, reduced[p]);
      if (parameter.kind == Kind::linear || parameter.kind == Kind::grid) {
        EXPECT_EQ(parameter.limit, Limit::stated);
        EXPECT_TRUE(parameter.per.empty());
        continue;
      }
      // A shape is searched for: from below it needs a bound of its own, from above one of its own or of the data; an
      // angle of either sign has both from the data.
      EXPECT_TRUE(std::isfinite(parameter.low) || parameter.limit == Limit::torsion);
      EXPECT_TRUE(std::isfinite(parameter.high) || parameter.limit != Limit::stated);
      EXPECT_TRUE(parameter.usual != 0.0 || parameter.low < 0.0);
      for (const std::string_view other : {parameter.per, parameter.root_of})
        EXPECT_TRUE(other.empty() || entry.index_of(other) < entry.parameters.size());
    }
    EXPECT_EQ(entry.parameters.size(), entry.count(Kind::linear) + entry.count(Kind::shape) + entry.count(Kind::given) +
                                           entry.count(Kind::grid));
    EXPECT_GT(entry.parameters.size(), 0U);
  }
}

// Torque becomes force, inertia mass, and angle length.
std::string on_linear_axis(std::string unit) {
  const auto replace = [&](std::string_view from, std::string_view to) {
    for (auto at = unit.find(from); at != std::string::npos; at = unit.find(from, at + to.size()))
      unit.replace(at, from.size(), to);
  };
  replace("kg*m^2", "kg");
  replace("N*m", "N");
  replace("rad", "m");
  return unit;
}

TEST(Catalogue, LinearAxisHasForcesAndMetresForTorquesAndAngles) {
  EXPECT_EQ(on_linear_axis("N*m*s^2/rad^2"), "N*s^2/m^2");
  for (const Entry& entry : catalogue::all())
    for (const auto& parameter : entry.parameters)
      EXPECT_EQ(parameter.unit.linear, on_linear_axis(std::string(parameter.unit.rotary))) << entry.name();
}

TEST(Catalogue, OffersEachEffectTheFunctionsOfItsPhase) {
  std::set<std::string_view> with_memory;
  for (const Entry& entry : catalogue::all()) {
    SCOPED_TRACE(entry.name());
    const bool source = entry.info->phase == Phase::source;
    // A shift that reaches another balance adds a torque as well.
    EXPECT_EQ(entry.real.torque != nullptr, source || entry.info->adds_to != 0);
    EXPECT_EQ(entry.dual.torque != nullptr, entry.real.torque != nullptr);
    EXPECT_EQ(entry.real.torque_of_plain != nullptr, entry.real.torque != nullptr);
    EXPECT_EQ(entry.real.change != nullptr, !source);
    EXPECT_EQ(entry.dual.change != nullptr, !source);
    EXPECT_NE(entry.make, nullptr);
    if (entry.has_state) with_memory.insert(entry.name());
  }
  EXPECT_EQ(with_memory, (std::set<std::string_view>{"dahl_friction", "lugre_friction", "current_delay",
                                                     "dahl_hysteresis", "modified_dahl_hysteresis", "duhem_hysteresis",
                                                     "bouc_wen_hysteresis", "prandtl_ishlinskii_hysteresis",
                                                     "preisach_hysteresis", "torque_proportional_hysteresis"}));
}

TEST(Catalogue, SearchesForRatiosAndRootsAndComesBackToTheNaturalValues) {
  const Entry& bouc_wen = catalogue::get("bouc_wen_hysteresis");
  const std::vector<double> natural = {5000.0, 4e6, 2e6, 2.0};
  const std::vector<double> reduced = catalogue::reduced(bouc_wen, natural);
  EXPECT_DOUBLE_EQ(reduced[1], 2000.0);
  EXPECT_DOUBLE_EQ(reduced[2], 0.5);
  EXPECT_EQ(catalogue::natural(bouc_wen, reduced), natural);
  for (const Entry& entry : catalogue::all()) {
    std::vector<double> usual;
    for (const auto& parameter : entry.parameters) usual.push_back(parameter.usual);
    const std::vector<double> back = catalogue::natural(entry, catalogue::reduced(entry, usual));
    for (std::size_t p = 0; p < usual.size(); ++p) EXPECT_NEAR(back[p], usual[p], 1e-12 * std::abs(usual[p]));
  }
}

TEST(Catalogue, SaysThatANameIsUnknown) {
  EXPECT_EQ(catalogue::find("viscous"), nullptr);
  EXPECT_THROW(catalogue::get("viscous"), std::out_of_range);
  EXPECT_EQ(&catalogue::get("gravity"), catalogue::find("gravity"));
  const Entry& gravity = catalogue::get("gravity");
  EXPECT_EQ(gravity.index_of("tangent"), gravity.parameters.size());
}

TEST(Catalogue, SplitsListsOfNames) {
  EXPECT_TRUE(catalogue::split_names("").empty());
  EXPECT_EQ(catalogue::split_names("a,bc,d"), (std::vector<std::string_view>{"a", "bc", "d"}));
  EXPECT_TRUE(catalogue::names_contain("a,bc", "bc"));
  EXPECT_FALSE(catalogue::names_contain("a,bc", "b"));
}

}  // namespace
}  // namespace flexspline::tests
