// The catalogue: what users, model files and parameter blocks rely on stands as the published list of effects says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/unit/catalogue_published.hpp"

namespace flexspline::tests::catalogue_test {
namespace {

using catalogue::Balance;
using catalogue::Entry;
using catalogue::Kind;
using catalogue::Phase;
using effects::Limit;
using Values = std::vector<double>;

// Effects whose searched angles may have either sign.
const std::set<std::string_view>& signed_angles() {
  static const std::set<std::string_view> kNames = {"kinematic_error", "torsion_zero"};
  return kNames;
}

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

TEST(Catalogue, IsCompleteAndHasNothingThatIsNotPublished) {
  std::set<std::string_view> built, listed;
  std::size_t last = 0;
  for (const Entry& entry : catalogue::all()) {
    EXPECT_TRUE(built.insert(entry.name()).second) << entry.name() << " stands twice";
    EXPECT_GT(entry.id, last);
    EXPECT_LE(entry.id, effects::kLastId);
    last = entry.id;
    std::set<std::string_view> keys;
    for (const auto& parameter : entry.parameters) EXPECT_TRUE(keys.insert(parameter.name).second);
  }
  for (const Published& expected : published()) EXPECT_TRUE(listed.insert(expected.name).second) << expected.name;
  EXPECT_EQ(built, listed);
  for (const std::string_view name : kMadeByUsers) EXPECT_EQ(catalogue::find(name), nullptr);
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
    for (const std::string_view list : {info.confused_with, info.replaces, info.modulates, info.contains})
      for (const std::string_view name : catalogue::split_names(list)) {
        EXPECT_TRUE(is_published(name)) << '"' << name << '"';
        EXPECT_NE(name, entry.name());
      }
    EXPECT_FALSE(info.confused_with.empty());
    if (info.phase == Phase::modulate)
      EXPECT_NE(catalogue::find(info.modulates), nullptr) << "what it scales must be there to be scaled";
    else
      EXPECT_TRUE(info.modulates.empty());
  }
}

Values usual_values(const Entry& entry) {
  Values usual;
  for (const auto& parameter : entry.parameters) usual.push_back(parameter.usual);
  return usual;
}

// Bounds hold for the parameter as it is searched for: a ratio or a root where it is stated so.
TEST(Catalogue, BoundsHoldTheUsualValueAndShapesAreBounded) {
  for (const Entry& entry : catalogue::all()) {
    const Values reduced = catalogue::reduced(entry, usual_values(entry));
    for (std::size_t p = 0; p < reduced.size(); ++p) {
      const auto& parameter = entry.parameters[p];
      SCOPED_TRACE(std::string(entry.name()) + "." + std::string(parameter.name));
      EXPECT_TRUE(std::isfinite(parameter.usual));
      EXPECT_LT(parameter.low, parameter.high);
      EXPECT_LE(parameter.low, reduced[p]);
      EXPECT_GE(parameter.high, reduced[p]);
      if (parameter.kind == Kind::linear || parameter.kind == Kind::grid) {
        EXPECT_EQ(parameter.limit, Limit::stated);
        EXPECT_TRUE(parameter.per.empty() && parameter.root_of.empty());
        continue;
      }
      // What is searched for needs a bound of its own from below, and from above one of its own or of the data; an
      // angle of either sign has both from the data.
      const bool signed_angle = std::isinf(parameter.low);
      EXPECT_EQ(signed_angle, signed_angles().contains(entry.name()) && parameter.kind == Kind::nonlinear);
      if (signed_angle) {
        EXPECT_EQ(parameter.limit, Limit::torsion);
        EXPECT_TRUE(std::isinf(parameter.high));
      }
      EXPECT_TRUE(std::isfinite(parameter.high) || parameter.limit != Limit::stated);
      EXPECT_TRUE(parameter.usual != 0.0 || parameter.low < 0.0);
    }
    EXPECT_EQ(entry.parameters.size(), entry.count(Kind::linear) + entry.count(Kind::nonlinear) +
                                           entry.count(Kind::given) + entry.count(Kind::grid));
    EXPECT_GT(entry.parameters.size(), 0U);
  }
}

// A torque in proportion to one parameter has all its other torques, stiffnesses and dampings stated per that one.
TEST(Catalogue, StatesRatiosPerAParameterThatIsThereAndSizesOfAGridAsGrowingSharesOfTheRange) {
  std::map<std::string, std::string> per, roots;
  for (const Entry& entry : catalogue::all()) {
    double share = 0.0;
    for (const auto& parameter : entry.parameters) {
      const std::string key = std::string(entry.name()) + "." + std::string(parameter.name);
      for (const std::string_view other : {parameter.per, parameter.root_of}) {
        EXPECT_TRUE(other.empty() || entry.index_of(other) < entry.parameters.size()) << key;
        EXPECT_NE(other, parameter.name);
      }
      if (!parameter.per.empty()) per[key] = parameter.per;
      if (!parameter.root_of.empty()) roots[key] = parameter.root_of;
      if (parameter.kind != Kind::grid) continue;
      EXPECT_GT(parameter.share_of_range, share) << key;
      EXPECT_LE(parameter.share_of_range, 1.0) << key;
      share = parameter.share_of_range;
    }
  }
  EXPECT_EQ(per, (std::map<std::string, std::string>{{"lugre_friction.static", "coulomb"},
                                                     {"lugre_friction.stiffness", "coulomb"},
                                                     {"lugre_friction.damping", "coulomb"},
                                                     {"piecewise_stiffness.stiffness_2", "stiffness_1"},
                                                     {"piecewise_stiffness.stiffness_3", "stiffness_1"},
                                                     {"piecewise_stiffness.torque_1", "stiffness_1"},
                                                     {"piecewise_stiffness.torque_2", "torque_1"},
                                                     {"dahl_hysteresis.stiffness", "torque"},
                                                     {"modified_dahl_hysteresis.stiffness", "torque"},
                                                     {"bouc_wen_hysteresis.gamma", "beta"},
                                                     {"torque_proportional_hysteresis.ratio", "torque"},
                                                     {"torque_proportional_hysteresis.stiffness", "torque"}}));
  EXPECT_EQ(roots, (std::map<std::string, std::string>{{"bouc_wen_hysteresis.beta", "exponent"}}));
}

// Where an effect reaches balances other than its own, where its size shows, and which stay on the host.
TEST(Catalogue, SaysWhatReachesOtherBalancesAndWhatADriveCannotHold) {
  std::map<std::string_view, unsigned> reach;
  std::set<std::string_view> identified_on_motor, host_only;
  for (const Entry& entry : catalogue::all()) {
    if (entry.info->adds_to != 0) reach[entry.name()] = entry.info->adds_to;
    EXPECT_EQ(entry.info->adds_to & effects::on(entry.info->balance), 0U) << "its own balance needs no mention";
    EXPECT_TRUE(entry.adds_to(entry.info->balance));
    if (entry.identified_on() != entry.info->balance) identified_on_motor.insert(entry.name());
    if (entry.info->host_only) host_only.insert(entry.name());
  }
  const unsigned motor = effects::on(Balance::motor), load = effects::on(Balance::load);
  EXPECT_EQ(reach, (std::map<std::string_view, unsigned>{{"kinematic_error", motor},
                                                         {"torque_offset", motor | load},
                                                         {"torque_sensor_gain", motor | load},
                                                         {"torque_sensor_ripple", motor | load}}));
  // The gain of a sensor and the stiffness behind it are one on the transmission balance.
  EXPECT_EQ(identified_on_motor, (std::set<std::string_view>{"torque_sensor_gain"}));
  EXPECT_EQ(catalogue::get("torque_sensor_gain").identified_on(), Balance::motor);
  EXPECT_EQ(host_only, (std::set<std::string_view>{"preisach_hysteresis"}));
}

// Torque becomes force, inertia mass, and angle length.
std::string on_linear_axis(std::string unit) {
  const auto replace = [&](std::string_view from, std::string_view to) {
    for (auto at = unit.find(from); at != std::string::npos; at = unit.find(from, at + to.size()))
      unit.replace(at, from.size(), to);
  };
  replace("kg*m^2", "kg");
  replace("N*m", "N");
  replace("(N)", "N");
  replace("rad", "m");
  return unit;
}

TEST(Catalogue, LinearAxisHasForcesAndMetresForTorquesAndAngles) {
  EXPECT_EQ(on_linear_axis("N*m*s^2/rad^2"), "N*s^2/m^2");
  EXPECT_EQ(on_linear_axis("1/(N*m)"), "1/N");
  EXPECT_EQ(on_linear_axis("rad/(N*m*s)"), "m/(N*s)");
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
  EXPECT_EQ(with_memory,
            (std::set<std::string_view>{"dahl_friction", "lugre_friction", "current_delay", "dahl_hysteresis",
                                        "modified_dahl_hysteresis", "duhem_hysteresis", "bouc_wen_hysteresis",
                                        "prandtl_ishlinskii_hysteresis", "preisach_hysteresis",
                                        "torque_proportional_hysteresis", "driving_dependent_loss"}));
}

TEST(Catalogue, SaysThatANameIsUnknown) {
  EXPECT_EQ(catalogue::find("viscous"), nullptr);
  EXPECT_THROW(catalogue::get("viscous"), std::out_of_range);
  EXPECT_EQ(&catalogue::get("gravity"), catalogue::find("gravity"));
  const Entry& gravity = catalogue::get("gravity");
  EXPECT_EQ(gravity.index_of("tangent"), gravity.parameters.size());
}

// A new effect states what it is confused with, and its rivals' headers stay as they are.
TEST(Catalogue, ConfusionsHoldBothWaysWhicheverHeaderStatesThem) {
  const auto has = [](std::string_view effect, std::string_view other) {
    const auto names = catalogue::confused_with(catalogue::get(effect));
    return std::count(names.begin(), names.end(), other);
  };
  EXPECT_FALSE(
      catalogue::names_contain(catalogue::get("torque_ripple").info->confused_with, "angle_dependent_friction"));
  EXPECT_EQ(has("torque_ripple", "angle_dependent_friction"), 1);
  EXPECT_EQ(has("angle_dependent_friction", "torque_ripple"), 1);
  for (const Entry& one : catalogue::all())
    for (const Entry& other : catalogue::all()) {
      EXPECT_EQ(has(one.name(), other.name()), has(other.name(), one.name())) << one.name() << " " << other.name();
      EXPECT_LE(has(one.name(), other.name()), 1);
    }
}

TEST(Catalogue, SplitsListsOfNames) {
  EXPECT_TRUE(catalogue::split_names("").empty());
  EXPECT_EQ(catalogue::split_names("a,bc,d"), (std::vector<std::string_view>{"a", "bc", "d"}));
  EXPECT_TRUE(catalogue::names_contain("a,bc", "bc"));
  EXPECT_FALSE(catalogue::names_contain("a,bc", "b"));
}

}  // namespace
}  // namespace flexspline::tests::catalogue_test
