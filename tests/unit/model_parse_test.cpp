// Reading model files: what is read, and each mistake with its line and what to do.
#include <gtest/gtest.h>

#include <string>

#include "host/physics/model/model.hpp"
#include "tests/unit/model_some_effects.hpp"

namespace flexspline::model::model_parse_test {
namespace {

const std::string kHead = "format = \"flexspline-model/1\"\n";  // line 1

Model model_of(const std::string& text) {
  return parse(text, "m.toml", SomeEffects()).model;
}

std::string error_of(const std::string& text) {
  try {
    parse(text, "m.toml", SomeEffects());
  } catch (const ModelError& error) {
    return error.what();
  }
  return "no error";
}

// The message begins with file and line, holds `what` and, after a semicolon, something to do that holds `remedy`.
void expect_error(const std::string& text, int line, const std::string& what, const std::string& remedy) {
  const std::string message = error_of(text);
  EXPECT_TRUE(message.starts_with("m.toml:" + std::to_string(line) + ": ")) << message;
  const std::size_t at = message.find(what);
  ASSERT_NE(at, std::string::npos) << message;
  const std::size_t semicolon = message.find("; ", at + what.size());
  ASSERT_NE(semicolon, std::string::npos) << message;
  EXPECT_NE(message.find(remedy, semicolon), std::string::npos) << message;
}

TEST(ModelParse, PolePairsAndSlotsAreWholeNumbersFromOneToAThousand) {
  const Model model =
      model_of(kHead + "[drive]\npole_pairs = 7\nmotor_slots = { value = 12.0, source = \"data sheet\" }\n");
  EXPECT_EQ(model.drive.pole_pairs.value, 7.0);
  EXPECT_EQ(model.drive.motor_slots.value, 12.0);
  EXPECT_EQ(model.drive.motor_slots.source, "data sheet");
  EXPECT_FALSE(model_of(kHead + "[drive]\ngear_ratio = 100\n").drive.pole_pairs.value);
  for (const std::string key : {"pole_pairs", "motor_slots"}) {
    const auto with = [&](const std::string& value) { return kHead + "[drive]\n" + key + " = " + value + "\n"; };
    expect_error(with("3.5"), 3, key + " = 3.5 is not a whole number", "how many the motor has");
    expect_error(with("{ value = 0.99999999 }"), 3, "is not a whole number", "how many the motor has");
    expect_error(with("0"), 3, key + " = 0 is outside its bounds", "between 1 and 1000");
    expect_error(with("-4"), 3, key + " = -4 is outside its bounds", "between 1 and 1000");
    expect_error(with("1e6"), 3, "is outside its bounds", "between 1 and 1000");
    expect_error(with("\"7\""), 3, key + " is text, not a number", "without quotes");
    expect_error(with("true"), 3, key + " is", "without quotes");
    expect_error(with("nan"), 3, key + " is NaN", "leave the key out");
    expect_error(with("{ value = 7, unit = \"1\" }"), 3, "has no key \"unit\"", "value, source");
  }
  expect_error(kHead + "[drive]\npole_pair = 7\n", 3, "no key \"pole_pair\"", "\"pole_pairs\"");
}

TEST(ModelParse, ReadsDriveEffectsAndHistory) {
  const Model model = model_of(R"(format = "flexspline-model/1"
name = "rhs-100"
[drive]
axis = "rotary"
gear_ratio = 100
torque_constant_nm_a = { value = 0.04275, source = "report, table 3" }
[[effect]]
type = "viscous_friction"
[effect.parameters]
coefficient = { value = 3.63e-4, unit = "N*m*s/rad", std = 2.1e-5, spread_percent = 16.7, fixed = true }
[[effect]]
type = "torque_ripple"
id = "ripple-4"
[effect.parameters]
sine = 0.002
order = 4
[[history]]
action = "add"
effect = "ripple-4"
rmse_before = 0.0123
)");
  EXPECT_EQ(model.name, "rhs-100");
  EXPECT_EQ(model.drive.gear_ratio.value, 100.0);
  EXPECT_EQ(model.drive.torque_constant_nm_a.value, 0.04275);
  EXPECT_EQ(model.drive.torque_constant_nm_a.source, "report, table 3");
  EXPECT_FALSE(model.drive.rated_current_a.value);
  ASSERT_EQ(model.effects.size(), 2U);
  EXPECT_EQ(model.effects[0].id, "viscous_friction");
  const Parameter& coefficient = model.effects[0].parameters.at(0);
  EXPECT_EQ(coefficient.value, 3.63e-4);
  EXPECT_EQ(coefficient.unit, "N*m*s/rad");
  EXPECT_EQ(coefficient.std, 2.1e-5);
  EXPECT_EQ(coefficient.spread_percent, 16.7);
  EXPECT_TRUE(coefficient.fixed);
  const Effect* ripple = model.find("ripple-4");
  ASSERT_NE(ripple, nullptr);
  ASSERT_EQ(ripple->parameters.size(), 3U);  // the catalogue's order, not the file's
  EXPECT_EQ(ripple->parameters[0].name, "order");
  EXPECT_EQ(ripple->parameters[0].value, 4.0);
  EXPECT_FALSE(ripple->parameters[1].value);
  EXPECT_EQ(ripple->parameters[1].unit, "N*m");
  EXPECT_EQ(ripple->find("sine")->value, 0.002);
  EXPECT_EQ(ripple->find("tangent"), nullptr);
  ASSERT_EQ(model.history.size(), 1U);
  EXPECT_EQ(model.history[0].action, "add");
  EXPECT_EQ(model.history[0].rmse_before, 0.0123);
  EXPECT_FALSE(model.history[0].rmse_after);
}

TEST(ModelParse, ReadsTheSameFromSubTablesInlineTablesAndDottedKeys) {
  for (const char* form : {"[effect.parameters]\ntorque = { value = 0.045, std = 0.001 }\n",
                           "[effect.parameters.torque]\nvalue = 0.045\nstd = 0.001\n",
                           "parameters = { torque = { value = 0.045, std = 0.001 } }\n",
                           "parameters.torque.value = 0.045\nparameters.torque.std = 0.001\n"}) {
    const Model model = model_of(kHead + "[[effect]]\ntype = \"coulomb_friction\"\n" + form);
    ASSERT_EQ(model.effects.size(), 1U);
    EXPECT_EQ(model.effects[0].parameters[0].value, 0.045) << form;
    EXPECT_EQ(model.effects[0].parameters[0].std, 0.001) << form;
  }
}

TEST(ModelParse, ALinearAxisTakesTheLinearUnitsEvenWhereDriveComesLast) {
  const Model model = model_of(kHead +
                               "[[effect]]\ntype = \"coulomb_friction\"\n[effect.parameters]\n"
                               "torque = { value = 20, unit = \"N\" }\n[drive]\naxis = \"linear\"\n");
  EXPECT_EQ(model.drive.axis, data::Axis::linear);
  EXPECT_EQ(model.effects[0].parameters[0].unit, "N");
}

TEST(ModelParse, AModelMayBeEmptyOfEffectsAndStartWithAByteOrderMark) {
  EXPECT_TRUE(model_of("\xEF\xBB\xBF" + kHead).effects.empty());
}

TEST(ModelParse, SpellingsOfAUnitAreTheSameUnit) {
  for (const char* unit : {"N*m*s/rad", "N m s/rad", "Nms/rad", "N\u00B7m\u00B7s/rad", "N.m.s/rad", "N*m/(rad/s)",
                           "s*N*m*rad^-1", "N m s / rad", " N*m*s/rad "}) {
    const std::string text = kHead + "[[effect]]\ntype = \"viscous_friction\"\n[effect.parameters]\n" +
                             "coefficient = { value = 0.1, unit = \"" + unit + "\" }\n";
    EXPECT_EQ(error_of(text), "no error") << unit;
  }
  for (const char* unit : {"mN*m*s/rad", "N*m*s", "N*m*s/deg", "Nms/rpm", "", "what?", "N*m*s/rad)", "((((((((((N"}) {
    const std::string text = kHead + "[[effect]]\ntype = \"viscous_friction\"\n[effect.parameters]\n" +
                             "coefficient = { value = 0.1, unit = \"" + unit + "\" }\n";
    expect_error(text, 5, "\"N*m*s/rad\" is expected", "write unit = \"N*m*s/rad\"");
  }
}

TEST(ModelParse, AUnitOfTheOtherAxisIsAnErrorThatNamesTheExpectedOne) {
  const std::string effect =
      "[[effect]]\ntype = \"coulomb_friction\"\n[effect.parameters.torque]\nvalue = 1\nunit = \"Nm\"\n";
  EXPECT_EQ(error_of(kHead + effect), "no error");
  expect_error(kHead + "[drive]\naxis = \"linear\"\n" + effect, 8, "\"N\" is expected", "unit = \"N\"");
  expect_error(kHead +
                   "[[effect]]\ntype = \"power_law_friction\"\n[effect.parameters]\n"
                   "exponent = { value = 0.5, unit = \"N\" }\n",
               5, "none is expected", "leave the unit out");
}

TEST(ModelParse, AValueRoundedOutOfItsBoundsIsTheBound) {
  const std::string text = kHead + "[[effect]]\ntype = \"power_law_friction\"\n[effect.parameters]\nexponent = ";
  EXPECT_EQ(model_of(text + "0.785399\n").effects[0].find("exponent")->value, 0.7853981633974483);
  EXPECT_EQ(model_of(text + "0.05\n").effects[0].find("exponent")->value, 0.05);
  expect_error(text + "0.7855\n", 5, "exponent = 0.7855 is outside", "between 0.05 and 0.785398");
  expect_error(text + "0\n", 5, "exponent = 0 is outside", "between 0.05");
  expect_error(text + "{ value = -1.5 }\n", 5, "exponent = -1.5 is outside", "between 0.05");
}

TEST(ModelParse, NamesTheLineOfEveryMistakeInAnEffect) {
  const std::string head = kHead + "[[effect]]\n";  // lines 1 and 2
  const std::string viscous = head + "type = \"viscous_friction\"\n[effect.parameters]\n";
  expect_error(head + "type = \"viscous_frction\"\n", 3, "no effect \"viscous_frction\"", "\"viscous_friction\"");
  expect_error(head + "type = \"hovercraft_full_of_eels\"\n", 3, "no effect", "flexspline effects");
  expect_error(head + "id = \"a\"\n", 2, "has no type", "type = ");
  expect_error(head + "type = 3\n", 3, "type is a number", "in quotes");
  expect_error(head + "type = \"viscous_friction\"\ncoefficient = 1\n", 4, "outside the parameters",
               "[effect.parameters]");
  expect_error(head + "type = \"viscous_friction\"\ntpe = 1\n", 4, "no key \"tpe\"", "\"type\"");
  expect_error(head + "type = \"viscous_friction\"\nparameters = 3\n", 4, "are a number", "[effect.parameters]");
  expect_error(head + "type = \"viscous_friction\"\n[[effect.parameters]]\ncoefficient = 1\n", 4, "are an array",
               "single brackets");
  expect_error(head + "type = \"viscous_friction\"\nid = \"my friction\"\n", 4, "id \"my friction\"", "without spaces");
  expect_error(viscous + "coeficient = 1\n", 5, "no key \"coeficient\"", "\"coefficient\"");
  expect_error(viscous + "zzzzzzzzzz = 1\n", 5, "no key \"zzzzzzzzzz\"", "known are coefficient");
  expect_error(viscous + "coefficient = \"1\"\n", 5, "coefficient is text, not a number", "without quotes");
  expect_error(viscous + "coefficient = true\n", 5, "true or false, not a number", "without quotes");
  expect_error(viscous + "coefficient = 2020-01-01\n", 5, "a date or time, not a number", "without quotes");
  expect_error(viscous + "coefficient = nan\n", 5, "coefficient is NaN", "finite");
  expect_error(viscous + "coefficient = { value = -inf }\n", 5, "coefficient is infinite", "finite");
  expect_error(viscous + "\n# \u00e4\ncoefficient = { value = 11.0 }\n", 7, "outside its bounds", "between 0 and 10");
  expect_error(viscous + "coefficient = { valu = 1 }\n", 5, "no key \"valu\"", "\"value\"");
  expect_error(viscous + "coefficient = { value = 1, std = -0.1 }\n", 5, "std = -0.1 is negative", "0 or more");
  expect_error(viscous + "coefficient = { value = 1, std = nan }\n", 5, "std is NaN", "finite");
  expect_error(viscous + "coefficient = { value = 1, spread_percent = \"x\" }\n", 5, "spread_percent is text",
               "without quotes");
  expect_error(viscous + "coefficient = { value = 1, fixed = 1 }\n", 5, "fixed is a number", "true or false");
  expect_error(viscous + "coefficient = { fixed = true }\n", 5, "fixed, but has no value", "value = NUMBER");
  expect_error(viscous + "coefficient = { value = 1, unit = 3 }\n", 5, "unit is a number", "in quotes");
  expect_error(head + "type = \"torque_ripple\"\n", 3, "torque_ripple needs its order", "order = NUMBER");
  expect_error(head + "type = \"torque_ripple\"\n[effect.parameters]\norder = { unit = \"-\" }\n", 5, "needs its order",
               "order = NUMBER");
}

TEST(ModelParse, TwoEffectsOfOneIdAreAnErrorThatNamesBothLines) {
  const std::string twice =
      kHead + "[[effect]]\ntype = \"viscous_friction\"\n[[effect]]\ntype = \"viscous_friction\"\n";
  expect_error(twice, 5, "a second effect is named \"viscous_friction\", the first one on line 3", "id = ");
  EXPECT_EQ(error_of(twice + "id = \"other\"\n"), "no error");
  expect_error(kHead + "[[effect]]\ntype = \"viscous_friction\"\nid = \"a\"\n[[effect]]\nid = \"a\"\n" +
                   "type = \"coulomb_friction\"\n",
               6, "named \"a\", the first one on line 4", "id = ");
}

TEST(ModelParse, NamesTheLineOfEveryMistakeElsewhere) {
  expect_error("", 1, "it has no format", "format = \"flexspline-model/1\"");
  expect_error("name = \"x\"\n", 1, "it has no format", "before its first table");
  expect_error("\nformat = \"flexspline-model/2\"\n", 2, "flexspline-model/2", "flexspline-model/1");
  expect_error("format = 1\n", 1, "format is a number", "flexspline-model/1");
  expect_error(kHead + "name = 4\n", 2, "name is a number", "in quotes");
  expect_error(kHead + "drvie = 4\n", 2, "no key \"drvie\"", "\"drive\"");
  expect_error(kHead + "drive = 4\n", 2, "drive is a number", "[drive]");
  expect_error(kHead + "[effect]\ntype = \"viscous_friction\"\n", 2, "effect is a table", "[[effect]]");
  expect_error(kHead + "effect = [ { type = \"viscous_friction\" } ]\n", 2, "an array of values", "[[effect]]");
  expect_error(kHead + "[drive]\naxis = \"round\"\n", 3, "axis is \"round\"", "\"rotary\" or \"linear\"");
  expect_error(kHead + "[drive]\ngear_raito = 100\n", 3, "no key \"gear_raito\"", "\"gear_ratio\"");
  expect_error(kHead + "[drive]\ngear_ratio = 0\n", 3, "gear_ratio = 0", "greater than 0");
  expect_error(kHead + "[drive]\ngear_ratio = -100\n", 3, "gear_ratio = -100", "greater than 0");
  expect_error(kHead + "[drive]\ngear_ratio = { value = \"100\" }\n", 3, "is text", "without quotes");
  expect_error(kHead + "[drive]\ngear_ratio = { value = 1, unit = \"-\" }\n", 3, "unit is in its name) has no key",
               "source");
  expect_error(kHead + "[drive]\ngear_ratio = { value = 1, source = 3 }\n", 3, "source is a number", "in quotes");
  expect_error(kHead + "[drive]\ntemperature_reference_c = -300\n", 3, "-300", "between -273.15");
  expect_error(kHead + "[[history]]\naction = \"add\"\n", 2, "no effect", "effect = ");
  expect_error(kHead + "[[history]]\naction = \"add\"\neffect = \"x\"\nrmse = 1\n", 5, "no key \"rmse\"", "known are");
  expect_error(kHead + "[[history]]\naction = \"add\"\neffect = \"x\"\nrmse_after = inf\n", 5, "infinite", "finite");
  expect_error(kHead + "[drive]\ngear_ratio = 1,5\n", 3, "not TOML", "decimal point");
  expect_error(kHead + "[drive]\ngear_ratio = 1\ngear_ratio = 2\n", 4, "not TOML", "once");
  for (const char* header : {"[.x]\n", "[#]\n", "[=", "[[", "[\xc3\xa4]\n"})
    expect_error(kHead + header, 2, "not TOML", "correct");
  for (const char* letter :
       {"\u00e4 = 1", "a = \u00e4", "[\u00b5]", "name = \"\"\"\"\"\" \u00e4", "name = '\\' # '\n\u00e4"})
    EXPECT_NE(error_of(kHead + letter).find("outside quotes; correct it"), std::string::npos) << letter;
  EXPECT_EQ(error_of(kHead + "name = \"\"\"\\\"\"\"\u00e4'\n\u00e4\"\"\"\"\" # '\u00e4"), "no error");
  expect_error(kHead + "name = \"\xff\"\n", 2, "not TOML", "UTF-8");
  expect_error(kHead + "a = 1\"\u00e4\"", 2, "expected digit", "correct");
}

TEST(ModelParse, AFileOfAnotherKindIsNoModelFileAndIsNotToBeCorrected) {
  for (const char* other : {"time,current\n0,1\n", "{\"format\": 1}", "[1, 2]", "# Notes\n",
                            "\x7f"
                            "ELF"})
    expect_error(other, 1, "this is not a model file", "format = \"flexspline-model/1\"");
  EXPECT_EQ(error_of("time,current\n").find("correct"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::model::model_parse_test
