// export as a user runs it; what it writes is read by others' programs: a C compiler, awk, libxml2, urdfdom.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::export_test {
namespace {

// Friction that a straight line describes, so that a joint has all of it: N = 100.
constexpr const char* kModel = R"(format = "flexspline-model/1"
name = "rhs-100"
[drive]
axis = "rotary"
gear_ratio = 100
torque_constant_nm_a = 0.05
rated_velocity_rad_s = 200.0
rated_torque_nm = 40.0
[[effect]]
type = "inertia"
parameters = { inertia = { value = 1e-4, unit = "kg*m^2" } }
[[effect]]
type = "viscous_friction"
parameters = { coefficient = { value = 4e-4, unit = "N*m*s/rad" } }
[[effect]]
type = "coulomb_friction"
parameters = { torque = { value = 0.05, unit = "N*m" } }
[[effect]]
type = "torque_ripple"
parameters = { order = { value = 2 }, cosine = { value = 0.01, unit = "N*m" }, sine = { value = 0.0, unit = "N*m" } }
[[effect]]
type = "linear_stiffness"
parameters = { stiffness = { value = 8000, unit = "N*m/rad" } }
[[effect]]
type = "output_viscous_friction"
parameters = { coefficient = { value = 0.5, unit = "N*m*s/rad" } }
)";
constexpr double kDamping = 1e4 * 4e-4 + 0.5;
constexpr double kFriction = 100 * 0.05;

TEST(ExportCommand, WritesAHeaderThatACompilerTakesAndThatSaysWhatTheModelSays) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.must("flexspline export --model m.toml --as c --out drive.h");
  shell.write("main.c", R"(#include <stdio.h>
#include "drive.h"
int main(void) {
  rhs_100_state state = {0};
  rhs_100_inputs in = {0};
  rhs_100_torques out;
  in.motor_velocity = 10.0;
  in.motor_acceleration = 50.0;
  in.direction = 1.0;
  in.output_position = -1e-3;
  in.output_velocity = 0.1;
  rhs_100_step(&state, &in, &out);
  printf("%.12g %.12g %.12g %g %g\n", out.motor, out.transmission, out.load, RHS_100_GEAR_RATIO, RHS_100_TORQUE_CONSTANT);
  return 0;
}
)");
  // 1e-4 * 50 + 4e-4 * 10 + 0.05 + 0.01 at angle zero; 8000 * 1e-3; 0.5 * 0.1.
  EXPECT_EQ(shell.must("cc -std=c99 -Wall -Wextra -Werror -pedantic main.c -o main -lm && ./main"),
            "0.069 8 0.05 100 0.05\n");
}

TEST(ExportCommand, TablesAreReadByAwkAndGiveTheFrictionLine) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.must("flexspline export --model m.toml --as csv --out tables");
  // |torque| = 0.05 + 4e-4 |w| at each row.
  EXPECT_EQ(
      shell.must("awk -F, 'NR>1 { w=$1<0?-$1:$1; t=$2<0?-$2:$2; e=t-0.05-4e-4*w; if (e<0) e=-e; if (e>1e-9) bad++ } "
                 "END { print NR-1, bad+0 }' tables/friction.csv"),
      "100 0\n");
  EXPECT_EQ(shell.must("awk -F, 'NR>1 { e=$2-8000*$1; if (e<0) e=-e; if (e>1e-6) bad++; if ($2>m) m=$2 } "
                       "END { printf \"%d %.4f\\n\", bad+0, m }' tables/stiffness.csv"),
            "0 40.0000\n");
  EXPECT_TRUE(contains(shell.file("tables/parameters.csv"), "viscous_friction,viscous_friction,coefficient,0.0004"));
  EXPECT_TRUE(contains(shell.file("tables/effect-torque_ripple.csv"), "motor_angle,"));
}

TEST(ExportCommand, ARobotIsReadByUrdfdomWithFrictionArmatureAndStiffness) {
  const Shell shell;
  shell.write("m.toml", kModel);
  const nlohmann::json answer = shell.json("flexspline export --model m.toml --as urdf --out drive.urdf");
  EXPECT_EQ(answer["left_out"], nlohmann::json::array({"torque_ripple"}));
  const urdf::ModelInterfaceSharedPtr robot = urdf::parseURDF(shell.file("drive.urdf"));
  ASSERT_TRUE(robot);
  const auto motor = robot->getJoint("rhs_100_motor");
  ASSERT_TRUE(motor && motor->dynamics && motor->limits);
  EXPECT_NEAR(motor->dynamics->damping, kDamping, 1e-6);
  EXPECT_NEAR(motor->dynamics->friction, kFriction, 1e-6);
  EXPECT_EQ(motor->limits->effort, 40.0);
  EXPECT_EQ(motor->limits->velocity, 2.0);
  ASSERT_TRUE(robot->getJoint("rhs_100_flexspline"));
  EXPECT_EQ(robot->getJoint("rhs_100_flexspline")->parent_link_name, "rhs_100_rotor");
  EXPECT_EQ(shell.must("xmllint --xpath 'string(//springStiffness)' drive.urdf"), "8000\n");
  EXPECT_EQ(shell.must("xmllint --xpath 'string(//mechanicalReduction)' drive.urdf"), "100\n");
  EXPECT_EQ(shell.must("xmllint --xpath 'string(//*[local-name()=\"rotor_inertia\"]/@value)' drive.urdf"), "0.0001\n");
}

TEST(ExportCommand, AMujocoModelHasTheJointAtTheOutputSide) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.must("flexspline export --model m.toml --as mujoco --out drive.xml");
  const auto value = [&](const std::string& joint, const std::string& attribute) {
    return std::stod(
        shell.must("xmllint --xpath 'string(//joint[@name=\"rhs_100_" + joint + "\"]/@" + attribute + ")' drive.xml"));
  };
  EXPECT_NEAR(value("motor", "armature"), 1.0, 1e-9);
  EXPECT_NEAR(value("motor", "damping"), kDamping, 1e-6);
  EXPECT_NEAR(value("motor", "frictionloss"), kFriction, 1e-6);
  EXPECT_NEAR(value("flexspline", "stiffness"), 8000, 1e-3);
}

// The model with another line in place of one.
std::string model_with(std::string text, const std::string& line, const std::string& other) {
  const std::size_t at = text.find(line);
  EXPECT_NE(at, std::string::npos) << line;
  return text.replace(at, line.size(), other);
}

TEST(ExportCommand, OnALinearAxisTheOutputsInertiaIsAMass) {
  const Shell shell;
  std::string linear =
      model_with(kModel, "axis = \"rotary\"", "axis = \"linear\"") +
      "[[effect]]\ntype = \"output_inertia\"\nparameters = { inertia = { value = 12.5, unit = \"kg\" } }\n";
  for (const auto& [rotary, other] : {std::pair{"kg*m^2", "kg"},
                                      {"N*m*s/rad", "N*s/m"},
                                      {"N*m*s/rad", "N*s/m"},
                                      {"N*m/rad", "N/m"},
                                      {"\"N*m\"", "\"N\""},
                                      {"\"N*m\"", "\"N\""},
                                      {"\"N*m\"", "\"N\""}})
    linear = model_with(linear, rotary, other);
  shell.write("m.toml", linear);
  shell.must("flexspline export --model m.toml --as mujoco --out drive.xml");
  const std::string link = "//body[@name=\"rhs_100_link\"]/inertial";
  EXPECT_EQ(shell.must("xmllint --xpath 'string(" + link + "/@mass)' drive.xml"), "12.5\n");
  EXPECT_EQ(shell.must("xmllint --xpath 'string(" + link + "/@diaginertia)' drive.xml"), "1e-06 1e-06 1e-06\n");
  shell.must("flexspline export --model m.toml --as urdf --out drive.urdf");
  const urdf::ModelInterfaceSharedPtr robot = urdf::parseURDF(shell.file("drive.urdf"));
  ASSERT_TRUE(robot && robot->getLink("rhs_100_link") && robot->getLink("rhs_100_link")->inertial);
  EXPECT_EQ(robot->getLink("rhs_100_link")->inertial->mass, 12.5);
  EXPECT_LT(robot->getLink("rhs_100_link")->inertial->izz, 1e-3);
}

TEST(ExportCommand, WithoutARatedTorqueAStiffnessThatDependsOnItIsRefused) {
  const Shell shell;
  const std::string unrated = model_with(kModel, "rated_torque_nm = 40.0\n", "");
  shell.write("linear.toml", unrated);
  const std::string page = shell.must("flexspline export --model linear.toml --as mujoco");
  EXPECT_TRUE(contains(page, "Stiffness is the same at every torque.")) << page;
  EXPECT_FALSE(contains(page, "half the rated torque"));
  const std::string cubic = "[[effect]]\ntype = \"cubic_stiffness\"\nparameters = { stiffness = { value = 1e10 } }\n";
  shell.write("cubic.toml", unrated + cubic);
  const Answer refused = shell.run("flexspline export --model cubic.toml --as mujoco");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "rated_torque_nm")) << refused.err;
  shell.write("rated.toml", kModel + cubic);
  EXPECT_TRUE(contains(shell.must("flexspline export --model rated.toml --as mujoco"), "half the rated torque"));
}

TEST(ExportCommand, IdsThatDifferInSignsAloneKeepTablesAndMemoriesApart) {
  const Shell shell;
  std::string model = kModel;
  for (const char* id : {"c+", "c-", "motor_velocity"})
    model += std::string("[[effect]]\ntype = \"dahl_friction\"\nid = \"") + id +
             "\"\nparameters = { torque = { value = 0.01 }, presliding = { value = 0.01 } }\n";
  shell.write("m.toml", model);
  shell.must("flexspline export --model m.toml --as c --out drive.h");
  shell.write("main.c", "#include \"drive.h\"\nint main(void) { rhs_100_state s = {0}; (void)s; return 0; }\n");
  shell.must("cc -std=c99 -Wall -Wextra -Werror -pedantic main.c -o main -lm");

  std::string viscous = kModel;
  for (const char* id : {"c+", "c-"})
    viscous += std::string("[[effect]]\ntype = \"viscous_asymmetry\"\nid = \"") + id +
               "\"\nparameters = { coefficient = { value = 1e-5 } }\n";
  shell.write("v.toml", viscous);
  shell.must("flexspline export --model v.toml --as csv --out tables");
  EXPECT_TRUE(fs::exists(shell.folder() / "tables/effect-c_.csv"));
  EXPECT_TRUE(fs::exists(shell.folder() / "tables/effect-c_-2.csv"));
}

TEST(ExportCommand, ANameCannotEndTheHeadersComment) {
  const Shell shell;
  shell.write("m.toml", model_with(kModel, "name = \"rhs-100\"", "name = \"lin */ x /* y\""));
  shell.must("flexspline export --model m.toml --as c --out drive.h");
  shell.write("main.c", "#include \"drive.h\"\nint main(void) { return 0; }\n");
  shell.must("cc -std=c99 -Wall -Wextra -Werror -pedantic main.c -o main -lm");
}

TEST(ExportCommand, SaysWhatItCannotDo) {
  const Shell shell;
  shell.write("m.toml", kModel);
  const Answer no_folder = shell.run("flexspline export --model m.toml --as csv");
  EXPECT_EQ(no_folder.code, 2);
  EXPECT_TRUE(contains(no_folder.err, "--out DIR")) << no_folder.err;
  const Answer other = shell.run("flexspline export --model m.toml --as simulink");
  EXPECT_EQ(other.code, 2);
  EXPECT_TRUE(contains(other.err, "mujoco")) << other.err;
  std::string without_value = kModel;
  without_value.replace(without_value.find("value = 1e-4, "), 14, "");
  shell.write("open.toml", without_value);
  const Answer open = shell.run("flexspline export --model open.toml --as c");
  EXPECT_EQ(open.code, 2);
  EXPECT_TRUE(contains(open.err, "inertia.inertia")) << open.err;
  std::string unrated = kModel;
  unrated.replace(unrated.find("rated_velocity_rad_s = 200.0"), 28, "");
  shell.write("unrated.toml", unrated);
  const Answer rated = shell.run("flexspline export --model unrated.toml --as urdf");
  EXPECT_EQ(rated.code, 2);
  EXPECT_TRUE(contains(rated.err, "rated_velocity_rad_s")) << rated.err;
}

}  // namespace
}  // namespace flexspline::cli_test::export_test
