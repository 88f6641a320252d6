// What a drive's board states, for pack; where its shaft is; and how it goes back to what it was made as.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::drive_hardware_test {
namespace {

using nlohmann::json;

double setting(const json& unpacked, const std::string& name) {
  for (const json& q : unpacked["settings"])
    if (q["name"] == name) return q["value"].get<double>();
  return -1.0;
}

TEST(DriveHardware, PackForADriveTakesTheFullScalesOfItsBoardAndNamesASettingThatDisagrees) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0"});
  shell.must("flexspline backup --out made.block --drive " + twin.name());
  const json made = shell.json("flexspline unpack made.block");
  shell.write("model.toml", R"(format = "flexspline-model/1"
name = "demo"
[drive]
axis = "rotary"
gear_ratio = 100
torque_constant_nm_a = 0.0543
rated_current_a = 2.0
rated_velocity_rad_s = 200.0
rated_torque_nm = 40.0
temperature_reference_c = 30.0
[[effect]]
type = "inertia"
[effect.parameters]
inertia = { value = 1.0e-4, unit = "kg*m^2" }
[[effect]]
type = "linear_stiffness"
[effect.parameters]
stiffness = { value = 6300.0, unit = "N*m/rad" }
)");
  shell.write("d.toml",
              "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 16384\n[output_encoder]\ncounts = 262144\n");
  shell.must("flexspline pack --model model.toml --drive d.toml --out alone.block --tick-hz 20000");
  shell.must("flexspline pack --model model.toml --drive d.toml --out for.block --for-drive " + twin.name());
  const json alone = shell.json("flexspline unpack alone.block"), packed = shell.json("flexspline unpack for.block");
  for (const char* scale : {"current_sensor_full_scale", "amplifier_full_scale"}) {
    EXPECT_NEAR(setting(packed, scale), setting(made, scale), 1e-3 * setting(made, scale)) << scale;
    EXPECT_GT(std::abs(setting(alone, scale) - setting(made, scale)), 0.1) << scale;
  }
  const Answer refused = shell.run("flexspline flash --yes --block alone.block --drive " + twin.name());
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "are not those of this board")) << refused.err;
  shell.must("flexspline flash --yes --block for.block --drive " + twin.name());
  shell.write("wrong.toml", shell.file("d.toml") + "[amplifier]\nfull_scale_a = 2.5\n");
  const Answer wrong =
      shell.run("flexspline pack --model model.toml --drive wrong.toml --out w.block --for-drive " + twin.name());
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(contains(wrong.err, "wrong.toml:7: [amplifier] full_scale_a is 2.5 A, but the drive's board states"))
      << wrong.err;
}

TEST(DriveHardware, HomeSaysWhatTheDriveKnowsAndSetsTheAngleOfItsMotor) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0"});
  const json asked = shell.json("flexspline home --drive " + twin.name());
  EXPECT_EQ(asked["knows_turn"], true);
  EXPECT_EQ(asked["knows_output"], true);
  EXPECT_TRUE(asked["position_rad"].is_null());
  EXPECT_EQ(shell.json("flexspline home --position-rad -3.5 --drive " + twin.name())["position_rad"], -3.5);
  const Answer far = shell.run("flexspline home --position-rad 1e12 --drive " + twin.name());
  EXPECT_EQ(far.code, 2);
  EXPECT_TRUE(contains(far.err, "further than")) << far.err;
}

TEST(DriveHardware, HomeStoresTheZeroWhereTheEncodersKnowTheirAngleAndFlashKeepsIt) {
  const Shell shell;
  const std::string flash = (shell.folder() / "flash").string();
  {
    const TwinProcess twin({"--serve", "0", "--flash", flash});
    EXPECT_EQ(shell.run("flexspline home --store --drive " + twin.name()).code, 2) << "at which position?";
    shell.must("flexspline backup --out before.block --drive " + twin.name());
    EXPECT_EQ(shell.json("flexspline home --position-rad -3.5 --store --drive " + twin.name())["stored"], true);
    shell.must("flexspline backup --out stored.block --drive " + twin.name());
    EXPECT_NE(content_of(shell.folder() / "stored.block"), content_of(shell.folder() / "before.block"));
    const json again = shell.json("flexspline flash --block before.block --yes --drive " + twin.name());
    EXPECT_EQ(again["flashed"], false) << "with the zero that the drive has it is the same block";
  }
  const TwinProcess next({"--serve", "0", "--flash", flash});
  EXPECT_EQ(shell.json("flexspline home --drive " + next.name())["knows_output"], true);
}

TEST(DriveHardware, AFactoryResetLeavesNoBlock) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0"});
  const json answer = shell.json("flexspline restore --factory-reset --yes --drive " + twin.name());
  EXPECT_EQ(answer["erased"], true);
  EXPECT_TRUE(answer["after"].is_null());
  const Answer none = shell.run("flexspline backup --out b.block --drive " + twin.name());
  EXPECT_EQ(none.code, 2);
}

}  // namespace
}  // namespace flexspline::cli_test::drive_hardware_test
