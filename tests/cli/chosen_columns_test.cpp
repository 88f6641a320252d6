// new: columns that are left out, and signs that are turned.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::chosen_columns_test {
namespace {

constexpr double kInertia = 2e-4, kRatio = 100.0;

// Link position, a current of the other sign, and a second column that reads as a current, too.
std::string log() {
  std::string text = "t,q,i_q,motor_current\n";
  for (int k = 0; k < 1500; ++k) {
    const double t = 0.008 * k, speed = 60.0 * (std::cos(2.0 * t) + 0.5 * std::cos(5.3 * t));
    const double angle = 60.0 * (std::sin(2.0 * t) / 2.0 + 0.5 * std::sin(5.3 * t) / 5.3);
    const double torque = kInertia * -60.0 * (2.0 * std::sin(2.0 * t) + 2.65 * std::sin(5.3 * t)) + 1e-3 * speed +
                          0.05 * std::tanh(speed / 0.05);
    char line[120];
    std::snprintf(line, sizeof line, "%.9g,%.9g,%.9g,0.1\n", t, angle / kRatio, -torque / 0.1);
    text += line;
  }
  return text;
}

TEST(ChosenColumns, ASignIsTurnedAndSaidToBeWrongBefore) {
  const Shell shell;
  shell.write("log.csv", log());
  const std::string line =
      "flexspline new --from log.csv --out project --gear-ratio 100 --torque-constant 0.1 --position-side link --force";
  const Answer before = shell.run(line);
  EXPECT_TRUE(contains(before.err, "--turn current_a")) << before.err;
  const Answer turned = shell.run(line + " --turn current_a");
  EXPECT_EQ(turned.code, 0) << turned.err;
  EXPECT_FALSE(contains(turned.err, "--turn")) << turned.err;
  for (const nlohmann::json& p :
       shell.json("flexspline identify project --model project/base-model.toml")["parameters"])
    if (p["effect"] == "inertia") {
      EXPECT_NEAR(p["value"].get<double>(), kInertia, 0.05 * kInertia);
    }
  const Answer nothing = shell.run(line + " --turn torque_nm");
  EXPECT_EQ(nothing.code, 2);
  EXPECT_TRUE(contains(nothing.err, "--map torque_nm=THEIRS")) << nothing.err;
}

TEST(ChosenColumns, AColumnIsLeftOutWhateverItsName) {
  const Shell shell;
  shell.write("log.csv", log());
  shell.must("flexspline new --from log.csv --out project --without i_q --torque-constant 0.1");
  const std::string toml = shell.file("project/dataset.toml");
  EXPECT_TRUE(contains(toml, "source = \"motor_current\"")) << toml;
  const Answer unknown = shell.run("flexspline new --from log.csv --out other --without iq");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "i_q")) << unknown.err;
  shell.write("ours.csv", "time_s,current_a,motor_position_rad\n0,1,2\n");
  const Answer ours = shell.run("flexspline new --from ours.csv --out other --without current_a");
  EXPECT_EQ(ours.code, 2);
  EXPECT_TRUE(contains(ours.err, "always read")) << ours.err;
}

// What is mapped by hand is of the side that is stated.
TEST(ChosenColumns, AMappedPositionOfTheLinkIsTakenToTheMotorToo) {
  const Shell shell;
  shell.write("log.csv", log());
  shell.must(
      "flexspline new --from log.csv --out project --gear-ratio 100 --torque-constant 0.1 --turn current_a "
      "--position-side link --map motor_position_rad=q");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "scale = 100")) << shell.file("project/dataset.toml");
}

}  // namespace
}  // namespace flexspline::cli_test::chosen_columns_test
