// Changing model files in place: what changes, and that all else stays byte for byte.
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "host/physics/model/model.hpp"
#include "tests/unit/model_some_effects.hpp"

namespace flexspline::model::model_rewrite_test {
namespace {

const std::string kHead = "format = \"flexspline-model/1\"\n";

ModelFile file_of(const std::string& text) {
  return parse(text, "m.toml", SomeEffects());
}

// The text with each of the replacements made once; every one must be found.
std::string with(std::string text, const std::vector<std::pair<std::string, std::string>>& replacements) {
  for (const auto& [from, to] : replacements) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  return text;
}

const std::string kAnnotated = R"(# Drive 7 on the bench, 14 March. µ stands for friction here.
format   =  "flexspline-model/1"   # do not touch
name = 'rhs-100'

[drive]                          # known, not identified
axis = "rotary"
gear_ratio = 1_00                # teeth counted
torque_constant_nm_a = { value = 4.275e-2, source = "réport, table 3" }

# The oil is old.
[[effect]]
type = "viscous_friction"        # Tv
[effect.parameters]
  coefficient = { value = 3.630e-4, unit = "N m s/rad", std = 2.10e-5, spread_percent = 16.70, fixed = false }   # °

# Coulomb comes next.
#  It is the larger one.
[[effect]]
id = "dry"
type = "coulomb_friction"
  # indented
  [effect.parameters.torque]
  # what the data sheet says: 0.05
  value = +0.0450                # sic
  unit = "Nm"

# Free comment.

# About the ripple.
[[effect]]
type = "torque_ripple"
parameters.order = 2
parameters.cosine = 1.0e-3
# after the ripple

[[history]]
action = "add"
effect = "torque_ripple"
rmse_before = 0.01230
# the end
)";

TEST(ModelRewrite, AnUnchangedModelKeepsEveryByte) {
  const ModelFile file = file_of(kAnnotated);
  EXPECT_EQ(rewrite(file, file.model), kAnnotated);
}

TEST(ModelRewrite, ReplacesNumbersWhereTheyStandAndNothingElse) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  Parameter& coefficient = *changed.find("viscous_friction")->find("coefficient");
  coefficient.value = 3.7123456e-4;
  coefficient.std = 1.23456e-5;
  coefficient.spread_percent = 8.0 / 3.0;
  changed.find("dry")->find("torque")->value = 1.0 / 3.0;
  changed.find("torque_ripple")->find("cosine")->value = -0.004;
  EXPECT_EQ(rewrite(file, changed), with(kAnnotated, {{"3.630e-4", "3.71235e-4"},
                                                      {"2.10e-5", "1.23e-5"},
                                                      {"16.70", "2.67"},
                                                      {"+0.0450 ", "0.333333 "},
                                                      {"1.0e-3", "-0.004"}}));
}

TEST(ModelRewrite, AValueThatIsTheSameWhenPrintedKeepsItsText) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  changed.find("viscous_friction")->find("coefficient")->value = 3.6300000001e-4;
  changed.find("viscous_friction")->find("coefficient")->std = 2.1001e-5;
  changed.find("dry")->find("torque")->value = 0.045000000001;
  EXPECT_EQ(rewrite(file, changed), kAnnotated);
}

TEST(ModelRewrite, InsertsWhatIsNewIntoInlineTablesSubTablesAndDottedKeys) {
  const ModelFile file = file_of(with(kAnnotated, {{", std = 2.10e-5, spread_percent = 16.70, fixed = false", ""}}));
  Model changed = file.model;
  changed.find("viscous_friction")->find("coefficient")->std = 2e-5;
  changed.find("viscous_friction")->find("coefficient")->spread_percent = 12;
  changed.find("dry")->find("torque")->std = 0.002;
  changed.find("dry")->find("torque")->fixed = true;
  changed.find("torque_ripple")->find("cosine")->std = 1e-4;
  changed.find("torque_ripple")->find("sine")->value = 2e6;
  EXPECT_EQ(rewrite(file, changed),
            with(file.text, {{"\"N m s/rad\" }", "\"N m s/rad\", std = 2e-5, spread_percent = 12 }"},
                             {"  unit = \"Nm\"\n", "  unit = \"Nm\"\n  std = 0.002\n  fixed = true\n"},
                             {"parameters.cosine = 1.0e-3\n",
                              "parameters.cosine = { value = 1.0e-3, unit = \"N*m\", std = 1e-4 }\n"
                              "parameters.sine = { value = 2e6, unit = \"N*m\" }\n"}}));
}

TEST(ModelRewrite, TakesOutWhatIsNoLongerKnown) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  Parameter& coefficient = *changed.find("viscous_friction")->find("coefficient");
  coefficient.value.reset();
  coefficient.std.reset();
  coefficient.spread_percent = std::numeric_limits<double>::quiet_NaN();
  changed.find("dry")->find("torque")->value.reset();
  changed.find("torque_ripple")->find("cosine")->value.reset();
  EXPECT_EQ(rewrite(file, changed), with(kAnnotated, {{"value = 3.630e-4, ", ""},
                                                      {", std = 2.10e-5, spread_percent = 16.70", ""},
                                                      {"  value = +0.0450                # sic\n", ""},
                                                      {"parameters.cosine = 1.0e-3\n", ""}}));
}

TEST(ModelRewrite, GivesAnEffectWithoutParametersATableOfThem) {
  const std::string text = kHead + "[[effect]]\ntype = \"power_law_friction\"  # open\n\n[[effect]]\n" +
                           "type = \"torque_ripple\"\n[effect.parameters.order]\nvalue = 2";
  const ModelFile file = file_of(text);
  Model changed = file.model;
  changed.effects[0].find("torque")->value = 0.02;
  changed.effects[0].find("exponent")->value = 0.5;
  changed.effects[1].find("sine")->value = 1e-3;
  EXPECT_EQ(rewrite(file, changed),
            kHead + "[[effect]]\ntype = \"power_law_friction\"  # open\n[effect.parameters]\n" +
                "torque = { value = 0.02, unit = \"N*m\" }\nexponent = 0.5\n\n[[effect]]\ntype = \"torque_ripple\"\n" +
                "[effect.parameters]\nsine = { value = 0.001, unit = \"N*m\" }\n[effect.parameters.order]\nvalue = 2");
}

TEST(ModelRewrite, PutsAParameterInTheOrderOfTheCatalogueAndFillsEmptyBraces) {
  const std::string text = kHead + "[[effect]]\ntype = \"power_law_friction\"\n[effect.parameters]\n# the exponent\n" +
                           "exponent = 0.5\n[[effect]]\ntype = \"coulomb_friction\"\nparameters = {}\n";
  const ModelFile file = file_of(text);
  Model changed = file.model;
  changed.effects[0].find("torque")->value = 0.02;
  changed.effects[1].find("torque")->value = 0.045;
  EXPECT_EQ(rewrite(file, changed),
            with(text, {{"# the exponent", "torque = { value = 0.02, unit = \"N*m\" }\n# the exponent"},
                        {"parameters = {}", "parameters = { torque = { value = 0.045, unit = \"N*m\" } }"}}));
}

TEST(ModelRewrite, CutsOutARemovedEffectWithTheCommentsDirectlyAbove) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  changed.effects.erase(changed.effects.begin() + 1);
  const std::size_t begin = kAnnotated.find("# Coulomb comes next.");
  const std::size_t end = kAnnotated.find("# Free comment.");
  EXPECT_EQ(rewrite(file, changed), kAnnotated.substr(0, begin) + kAnnotated.substr(end));

  changed = file.model;
  changed.effects.pop_back();
  const std::size_t ripple = kAnnotated.find("# About the ripple.");
  const std::size_t history = kAnnotated.find("[[history]]");
  EXPECT_EQ(rewrite(file, changed), kAnnotated.substr(0, ripple) + kAnnotated.substr(history));
}

TEST(ModelRewrite, CutsOutEveryPartOfAnEffectEvenWhereTheyStandApart) {
  const std::string effect = "[[effect]]\ntype = \"coulomb_friction\"\n\n";
  const std::string text = kHead + "\n" + effect + "# drive\n[drive]\ngear_ratio = 50\n\n" +
                           "# of the friction\n[effect.parameters]\ntorque = 0.1\n";
  const ModelFile file = file_of(text);
  Model changed = file.model;
  changed.effects.clear();
  EXPECT_EQ(rewrite(file, changed), kHead + "\n# drive\n[drive]\ngear_ratio = 50\n");
}

TEST(ModelRewrite, AppendsNewEffectsBehindTheOthersAndHistoryBehindItsLike) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  Effect ripple = effect_of("torque_ripple", "torque_ripple_4");
  ripple.find("order")->value = 4;
  ripple.find("sine")->value = 0.0025;
  ripple.find("sine")->std = 0.0001;
  changed.effects.insert(changed.effects.begin(), ripple);
  changed.effects.push_back(effect_of("power_law_friction"));
  changed.history.push_back({"add", "torque_ripple_4", 0.0041, 1.0 / 300.0});
  EXPECT_EQ(rewrite(file, changed),
            with(kAnnotated, {{"# after the ripple\n",
                               "# after the ripple\n\n[[effect]]\ntype = \"torque_ripple\"\nid = \"torque_ripple_4\"\n"
                               "[effect.parameters]\norder = 4\n"
                               "sine = { value = 0.0025, unit = \"N*m\", std = 1e-4 }\n\n"
                               "[[effect]]\ntype = \"power_law_friction\"\n"},
                              {"# the end\n",
                               "# the end\n\n[[history]]\naction = \"add\"\neffect = \"torque_ripple_4\"\n"
                               "rmse_before = 0.0041\nrmse_after = 0.00333333\n"}}));
}

TEST(ModelRewrite, AnEffectOfAnotherTypeUnderTheSameIdTakesThePlaceOfTheFirst) {
  const ModelFile file = file_of(kHead + "[[effect]]\ntype = \"coulomb_friction\"\nid = \"f\"\n");
  Model changed = file.model;
  changed.effects[0] = effect_of("viscous_friction", "f");
  EXPECT_EQ(rewrite(file, changed), kHead + "\n[[effect]]\ntype = \"viscous_friction\"\nid = \"f\"\n");
}

TEST(ModelRewrite, PolePairsAndSlotsStayAndAreWrittenWhereTheyAreNew) {
  const std::string text = kHead + "\n[drive]\npole_pairs = 7   # counted\n";
  const ModelFile file = file_of(text);
  EXPECT_EQ(rewrite(file, file.model), text);
  Model changed = file.model;
  changed.effects.push_back(effect_of("coulomb_friction"));
  changed.drive.motor_slots = {12.0, "data set"};
  const std::string result = rewrite(file, changed);
  EXPECT_NE(result.find("pole_pairs = 7   # counted\n"), std::string::npos) << result;
  EXPECT_EQ(file_of(result).model.drive.motor_slots.value, 12.0);
  EXPECT_EQ(file_of(result).model.drive.motor_slots.source, "data set");
  const std::string anew = write(changed);
  EXPECT_NE(anew.find("pole_pairs = 7  # of the motor\n"), std::string::npos) << anew;
  EXPECT_EQ(file_of(anew).model.drive.pole_pairs.value, 7.0);
  changed.drive.pole_pairs.value = 3.5;
  EXPECT_THROW(write(changed), std::logic_error);
}

TEST(ModelRewrite, AFileWithoutALastNewlineOrWithoutEffectsCanBeExtended) {
  ModelFile file = file_of("format = \"flexspline-model/1\"");
  Model changed = file.model;
  changed.effects.push_back(effect_of("coulomb_friction"));
  changed.history.push_back({"add", "coulomb_friction", {}, {}});
  changed.drive.gear_ratio.value = 100;
  const std::string effect = "[[effect]]\ntype = \"coulomb_friction\"\n";
  const std::string history = "[[history]]\naction = \"add\"\neffect = \"coulomb_friction\"\n";
  const std::string result = rewrite(file, changed);
  EXPECT_NE(result.find("\n\n" + effect), std::string::npos) << result;
  EXPECT_NE(result.find("\n\n" + history), std::string::npos) << result;
  EXPECT_NE(result.find("gear_ratio = 100\n"), std::string::npos) << result;
  EXPECT_LT(result.find(effect), result.find(history));

  file = file_of(kHead + "\n" + history);
  changed = file.model;
  changed.effects.push_back(effect_of("coulomb_friction"));
  EXPECT_EQ(rewrite(file, changed), kHead + "\n" + effect + "\n" + history);
}

TEST(ModelRewrite, KeepsWindowsNewlinesAndAByteOrderMark) {
  const std::string text =
      "\xEF\xBB\xBF"
      "format = \"flexspline-model/1\"\r\n\r\n[[effect]]\r\ntype = \"coulomb_friction\"\r\n";
  const ModelFile file = file_of(text);
  Model changed = file.model;
  changed.name = "n";
  changed.effects[0].find("torque")->value = 0.5;
  changed.effects.push_back(effect_of("viscous_friction"));
  EXPECT_EQ(rewrite(file, changed),
            "\xEF\xBB\xBF"
            "format = \"flexspline-model/1\"\r\nname = \"n\"\r\n\r\n[[effect]]\r\n"
            "type = \"coulomb_friction\"\r\n[effect.parameters]\r\ntorque = { value = 0.5, unit = \"N*m\" }\r\n\r\n"
            "[[effect]]\r\ntype = \"viscous_friction\"\r\n");
}

TEST(ModelRewrite, TextsThatLookLikeHeadersAndCommentsAreTexts) {
  const std::string text = "name = \"\"\"\n[[effect]]\n# not a comment\n\"\"\"\n" + kHead +
                           "[drive]\ngear_ratio = { value = 100, source = '# [[history]] \"x\"' }\n"
                           "[[effect]]\ntype = \"coulomb_friction\"\n";
  const ModelFile file = file_of(text);
  Model changed = file.model;
  changed.effects.clear();
  changed.drive.gear_ratio.value = 101.5;
  EXPECT_EQ(rewrite(file, changed), with(text, {{"100", "101.5"}, {"[[effect]]\ntype = \"coulomb_friction\"\n", ""}}));
}

TEST(ModelRewrite, ChangesTheDriveExactly) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  changed.name = "a \"new\" \\ name\n\x01";
  changed.drive.axis = data::Axis::linear;
  changed.drive.torque_constant_nm_a.value = 35.1512345678901;
  changed.drive.pitch_m = {0.005, "screw"};
  // On the other axis the units in the file would be wrong, so only the drive is kept.
  changed.effects.clear();
  const ModelFile again = file_of(rewrite(file, changed));
  EXPECT_EQ(again.model.name, changed.name);
  EXPECT_EQ(again.model.drive.axis, data::Axis::linear);
  EXPECT_EQ(again.model.drive.torque_constant_nm_a.value, 35.1512345678901);
  EXPECT_EQ(again.model.drive.torque_constant_nm_a.source, "réport, table 3");
  EXPECT_EQ(again.model.drive.pitch_m.value, 0.005);
  EXPECT_EQ(again.model.drive.pitch_m.source, "screw");
  EXPECT_NE(again.text.find("gear_ratio = 1_00                # teeth counted\n"), std::string::npos);
}

TEST(ModelRewrite, RefusesWhatItCannotWrite) {
  const ModelFile file = file_of(kAnnotated);
  Model changed = file.model;
  changed.effects[0].parameters[0].value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
  EXPECT_THROW(write(changed), std::logic_error);
  changed = file.model;
  changed.history.clear();
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
  changed = file.model;
  changed.history[0].effect = "other";
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
  changed = file.model;
  changed.effects.push_back(changed.effects[0]);
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
  changed = file.model;
  changed.effects[0].parameters.clear();
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
  changed = file.model;
  changed.effects[0].parameters[0].unit = "N";  // the file says another one
  EXPECT_THROW(rewrite(file, changed), std::logic_error);
}

TEST(ModelWrite, LooksLikeTheContract) {
  Model model;
  model.name = "rhs-100";
  model.drive.gear_ratio.value = 100;
  model.drive.torque_constant_nm_a = {0.04275, "report, table 3"};
  model.drive.rated_velocity_rad_s.value = 200;
  model.effects = {effect_of("viscous_friction"), effect_of("coulomb_friction")};
  model.effects[0].parameters[0] = {"coefficient", 3.63e-4, "N*m*s/rad", 2.1e-5, 16.7, false};
  model.history.push_back({"add", "coulomb_friction", 0.0123, 0.0041});
  EXPECT_EQ(write(model), R"(format = "flexspline-model/1"
name = "rhs-100"

[drive]  # known, not identified
axis = "rotary"
gear_ratio = 100
torque_constant_nm_a = { value = 0.04275, source = "report, table 3" }
rated_velocity_rad_s = 200  # motor side

# Effects on the torque balances; parameters without a value are to be identified.

[[effect]]
type = "viscous_friction"
[effect.parameters]
coefficient = { value = 3.63e-4, unit = "N*m*s/rad", std = 2.1e-5, spread_percent = 16.7 }

[[effect]]
type = "coulomb_friction"

[[history]]
action = "add"
effect = "coulomb_friction"
rmse_before = 0.0123
rmse_after = 0.0041
)");
}

}  // namespace
}  // namespace flexspline::model::model_rewrite_test
