// Tables and formulas in model files: what is read, what is said of mistakes, and what a rewrite leaves alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::model::model_user_defined_effects_test {
namespace {

constexpr const char* kTable = R"toml(format = "flexspline-model/1"

# The tooth that was chipped in May.
[[effect]]
type = "table_effect"
id = "tooth"            # seen on the report
variable = "motor_angle"
times_direction = true
[effect.table]
at = [0, 1.57079633, 3.14159265,   # a quarter turn each
      4.71238898]
value = [0.001, 0.02,  # the chip
         0.002, 0.000]
std = [1e-3, 1e-3, 1e-3, 1e-3]

[[effect]]
type = "expression_effect"
id = "seal"
balance = "load"
formula = "a*tanh(output_velocity/b)"
[effect.parameters]
a = { value = 0.3, unit = "N*m", low = 0 }   # about
b = { unit = "rad/s", low = 0.01, high = 2.0 }
)toml";

ModelFile parsed(const std::string& text) {
  return parse(text, "m.toml", catalogue::known_effects());
}

std::string error_of(const std::string& text) {
  try {
    parsed(text);
  } catch (const ModelError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

TEST(ModelFileOfUserDefinedEffects, ReadsTablesAndFormulas) {
  const Model model = parsed(kTable).model;
  ASSERT_EQ(model.effects.size(), 2U);
  const Effect& tooth = *model.find("tooth");
  ASSERT_TRUE(tooth.definition);
  EXPECT_EQ(tooth.definition->variable, "motor_angle");
  EXPECT_EQ(tooth.definition->balance, "motor");
  EXPECT_TRUE(tooth.definition->times_direction);
  EXPECT_EQ(tooth.definition->table.value, (std::vector<double>{0.001, 0.02, 0.002, 0.0}));
  EXPECT_EQ(tooth.definition->table.std.size(), 4U);
  EXPECT_FALSE(tooth.definition->table.fixed);
  EXPECT_TRUE(tooth.parameters.empty());
  const Effect& seal = *model.find("seal");
  EXPECT_EQ(seal.definition->formula, "a*tanh(output_velocity/b)");
  EXPECT_EQ(seal.definition->balance, "load");
  ASSERT_EQ(seal.parameters.size(), 2U);
  EXPECT_EQ(seal.find("a")->unit, "N*m");
  EXPECT_EQ(seal.find("a")->value, 0.3);
  EXPECT_EQ(seal.find("a")->low, 0.0);
  EXPECT_FALSE(seal.find("a")->high);
  EXPECT_EQ(seal.find("b")->high, 2.0);
  EXPECT_FALSE(seal.find("b")->value);
}

TEST(ModelFileOfUserDefinedEffects, ErrorsNameTheLine) {
  const auto error = [](const char* what, const char* by) { return error_of(replaced(kTable, what, by)); };
  EXPECT_EQ(error("\"motor_angle\"", "\"motor_angel\""),
            "m.toml:7: there is no signal \"motor_angel\"; did you mean \"motor_angle\"?");
  EXPECT_EQ(error("variable = \"motor_angle\"\n", ""),
            "m.toml:4: tooth has no variable; write variable = \"velocity\", for example");
  EXPECT_EQ(error("value = [0.001, ", "value = ["),
            "m.toml:12: value has 3 numbers, and at has 4; give one for each point");
  EXPECT_EQ(error("0.02, ", "\"0.02\", "),
            "m.toml:12: value is text, not a number; write a number without quotes and "
            "unit, such as value = 12");
  EXPECT_NE(
      error("3.14159265", "3.5").find("m.toml:9: point 3 of the table is at 3.5, and even steps would have it at"),
      std::string::npos);
  EXPECT_EQ(error("balance = \"load\"", "balance = \"out\""),
            "m.toml:19: there is no balance \"out\"; write \"motor\", \"transmission\" or \"load\"");
  EXPECT_NE(error("output_velocity/b", "output_velocty/b")
                .find("m.toml:20: the formula reads output_velocty, which is neither a signal nor a parameter; did you "
                      "mean output_velocity? signals are velocity, speed"),
            std::string::npos);
  EXPECT_NE(error("low = 0.01, high = 2.0", "low = 0.01").find("m.toml:23: b does not only scale the torque"),
            std::string::npos);
  EXPECT_EQ(error("value = 0.3", "value = -0.3"),
            "m.toml:22: a = -0.3 is outside its bounds; it must be between 0 and "
            "infinity");
  EXPECT_EQ(error("low = 0.01, high = 2.0", "low = 3.0, high = 2.0"),
            "m.toml:23: low of b is not below its high; write the smaller one as low");
  EXPECT_NE(error("times_direction = true", "points = 4").find("[[effect]] has no key \"points\""), std::string::npos);
}

TEST(ModelFileOfUserDefinedEffects, RewriteLeavesEveryByteOfWhatDoesNotChange) {
  const ModelFile file = parsed(kTable);
  EXPECT_EQ(rewrite(file, file.model), file.text);
}

TEST(ModelFileOfUserDefinedEffects, NumbersAreReplacedOneByOneAndCommentsStay) {
  const ModelFile file = parsed(kTable);
  Model changed = file.model;
  changed.find("tooth")->definition->table.value = {0.001, 0.0213456789, 0.002, 0.0};
  changed.find("tooth")->definition->table.std = {1e-3, 0.00251, 1e-3, 1e-3};
  changed.find("seal")->find("b")->value = 0.25;
  std::string expected = replaced(kTable, "0.02,  # the chip", "0.0213457,  # the chip");
  expected = replaced(expected, "std = [1e-3, 1e-3", "std = [1e-3, 0.00251");
  expected = replaced(expected, "b = { unit", "b = { value = 0.25, unit");
  EXPECT_EQ(rewrite(file, changed), expected);
}

TEST(ModelFileOfUserDefinedEffects, AnotherNumberOfPointsRewritesTheLists) {
  const ModelFile file = parsed(kTable);
  Model changed = file.model;
  Table& table = changed.find("tooth")->definition->table;
  table.at = {0.0, 3.14159265};
  table.value = {0.5, 0.25};
  table.std.clear();
  const std::string text = rewrite(file, changed);
  EXPECT_NE(text.find("# The tooth that was chipped in May."), std::string::npos);
  EXPECT_NE(text.find("value = [\n  0.5, 0.25,\n]"), std::string::npos) << text;
  EXPECT_EQ(text.find("std"), std::string::npos);
  EXPECT_EQ(parsed(text).model.find("tooth")->definition->table.value, table.value);
}

TEST(ModelFileOfUserDefinedEffects, TableWithoutPointsGetsThemBelowItsOwnEffect) {
  const std::string blank =
      "format = \"flexspline-model/1\"\n\n[[effect]]\ntype = \"table_effect\"\nvariable = \"velocity\"  # all of it\n\n"
      "[[effect]]\ntype = \"inertia\"\n";
  const ModelFile file = parsed(blank);
  Model changed = file.model;
  changed.effects[0].definition->table = {{-1.0, 0.0, 1.0}, {0.1, 0.2, 0.3}, {0.01, 0.01, 0.01}, true};
  const std::string text = rewrite(file, changed);
  EXPECT_LT(text.find("[effect.table]"), text.find("\"inertia\"")) << text;
  EXPECT_NE(text.find("# all of it"), std::string::npos);
  const Model read = parsed(text).model;
  EXPECT_EQ(read.effects[0].definition->table.at, (std::vector<double>{-1.0, 0.0, 1.0}));
  EXPECT_TRUE(read.effects[0].definition->table.fixed);
}

TEST(ModelFileOfUserDefinedEffects, NewFilesHoldThem) {
  const Model model = parsed(kTable).model;
  const Model read = parsed(write(model)).model;
  EXPECT_EQ(read.find("tooth")->definition->table.value, model.find("tooth")->definition->table.value);
  EXPECT_EQ(read.find("tooth")->definition->variable, "motor_angle");
  EXPECT_TRUE(read.find("tooth")->definition->times_direction);
  EXPECT_EQ(read.find("seal")->definition->formula, "a*tanh(output_velocity/b)");
  EXPECT_EQ(read.find("seal")->find("b")->low, 0.01);
  Model added = parsed("format = \"flexspline-model/1\"\n").model;
  added.effects = model.effects;
  const std::string text = rewrite(parsed("format = \"flexspline-model/1\"\n# mine\n"), added);
  EXPECT_EQ(parsed(text).model.effects.size(), 2U);
  Model without = model;
  without.effects.erase(without.effects.begin());
  const std::string smaller = rewrite(parsed(kTable), without);
  EXPECT_EQ(smaller.find("tooth"), std::string::npos);
  EXPECT_EQ(smaller.find("at = ["), std::string::npos);
}

}  // namespace
}  // namespace flexspline::model::model_user_defined_effects_test
