// pack and unpack as a user runs them.
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::pack_test {
namespace {

constexpr const char* kModel = R"(format = "flexspline-model/1"
name = "bench"
[drive]
axis = "rotary"
gear_ratio = 100
torque_constant_nm_a = 0.0543
rated_current_a = 2.0
rated_velocity_rad_s = 200.0
rated_torque_nm = 40.0
[[effect]]
type = "viscous_friction"
[effect.parameters]
coefficient = { value = 3.6123456789e-4, unit = "N*m*s/rad" }
[[effect]]
type = "stribeck_gaussian"
[effect.parameters]
amplitude_positive = { value = 0.012, unit = "N*m" }
amplitude_negative = { value = 0.01, unit = "N*m" }
velocity = { value = 3.0, unit = "rad/s" }
)";

TEST(PackCommand, MakesABlockThatUnpackTurnsIntoTheModelAgain) {
  const Shell shell;
  shell.write("m.toml", kModel);
  const nlohmann::json packed =
      shell.json("flexspline pack --model m.toml --out drive.block --drive-name arm-1 --encoder-counts 4096");
  EXPECT_EQ(packed["format"], "flexspline-pack/1");
  expect_fields(packed, {"bytes", "sha256", "max_error_nm", "max_error_share_of_rated", "proof"});
  EXPECT_EQ(packed["bytes"], shell.file("drive.block").size());
  EXPECT_EQ(packed["sha256"].get<std::string>(), shell.must("sha256sum drive.block").substr(0, 64));
  EXPECT_LT(packed["max_error_share_of_rated"], 1e-6);
  ASSERT_GT(packed["proof"].size(), 4u);
  for (const nlohmann::json& part : packed["proof"]) expect_fields(part, {"part", "kind", "bound", "unit"});

  const nlohmann::json unpacked = shell.json("flexspline unpack drive.block --out again.toml");
  EXPECT_EQ(unpacked["format"], "flexspline-unpack/1");
  EXPECT_EQ(unpacked["drive"], "arm-1");
  EXPECT_EQ(unpacked["model"], "bench");
  EXPECT_EQ(unpacked["encoder_counts"], 4096);
  EXPECT_EQ(unpacked["coefficients_follow_from_parameters"], true);
  EXPECT_EQ(unpacked["parameters"][0]["value"], 3.6123456789e-4);
  shell.must("flexspline pack --model again.toml --out again.block --drive-name arm-1 --encoder-counts 4096");
  EXPECT_EQ(shell.file("again.block"), shell.file("drive.block"));
}

TEST(PackCommand, WithSettingsMakesABlockThatADriveTakesAndWithoutSaysThatNoneDoes) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.must("flexspline pack --model m.toml --out model.block");
  const nlohmann::json model = shell.json("flexspline unpack model.block");
  EXPECT_TRUE(model["settings"].is_null());
  EXPECT_TRUE(contains(model["refused_by_a_drive"].get<std::string>(), "settings of the drive")) << model;
  const Answer refused = shell.run("flexspline-hil drive --seconds 0.1 --block model.block");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "--drive")) << refused.err;

  shell.write("d.toml",
              "format = \"flexspline-drive/1\"\n[motor]\ninertia_kg_m2 = 1.04e-4\n[motor_encoder]\ncounts = 16384\n"
              "[output_encoder]\ncounts = 262144\n[limits]\ncurrent_a = 3.5\n[torque_sensor]\n");
  shell.must("flexspline pack --model m.toml --drive d.toml --tick-hz 20000 --out drive.block");
  const nlohmann::json drive = shell.json("flexspline unpack drive.block");
  EXPECT_TRUE(drive["refused_by_a_drive"].is_null());
  for (const nlohmann::json& q : drive["settings"])
    if (q["name"] == "current_limit") {
      EXPECT_NEAR(q["value"].get<double>(), 3.5, 1e-6);
    }
  const nlohmann::json run = shell.json("flexspline-hil drive --seconds 1 --scenario sine --block drive.block");
  EXPECT_TRUE(run["runs"][1]["fault"].is_null());

  shell.write("d.toml", "format = \"flexspline-drive/1\"\n[motor]\ninertia = 1e-4\n");
  const Answer wrong = shell.run("flexspline pack --model m.toml --drive d.toml --encoder-counts 4096 --out no.block");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(contains(wrong.err, "d.toml")) << wrong.err;
}

TEST(PackCommand, RefusesWhatDoesNotFitAndWritesNothing) {
  const Shell shell;
  shell.write("m.toml", kModel);
  const Answer bound = shell.run("flexspline pack --model m.toml --out b.block --bound 1e-15");
  EXPECT_EQ(bound.code, 1);
  EXPECT_TRUE(contains(bound.err, "of rated torque")) << bound.err;
  const Answer image = shell.run("flexspline pack --model m.toml --out b.block --image viscous_friction,inertia");
  EXPECT_EQ(image.code, 2);
  EXPECT_TRUE(contains(image.err, "stribeck_gaussian does not fit: the firmware image lacks it")) << image.err;
  EXPECT_EQ(shell.run("test -e b.block").code, 1);
}

TEST(PackCommand, RefusesOptionsThatWouldNotBeUsed) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.write("d.toml", "format = \"flexspline-drive/1\"\n");
  for (const auto& [options, named] :
       {std::pair{"--drive d.toml --encoder-counts 4096 --filter-corner-hz 90", "--drive"},
        std::pair{"--filter-corner-hz 90", "--encoder-counts"},
        std::pair{"--for-drive twin --tick-hz 9000", "--tick-hz"},
        std::pair{"--for-drive twin --image inertia", "--image"}}) {
    const Answer answer = shell.run(std::string("flexspline pack --model m.toml --out b.block ") + options);
    EXPECT_EQ(answer.code, 2) << options;
    EXPECT_TRUE(contains(answer.err, named)) << answer.err;
  }
}

TEST(UnpackCommand, SaysWhatIsWrongWithABlock) {
  const Shell shell;
  shell.write("m.toml", kModel);
  shell.must("flexspline pack --model m.toml --out drive.block");
  shell.must("printf 'x' | dd of=drive.block bs=1 seek=300 conv=notrunc status=none");
  const Answer damaged = shell.run("flexspline unpack drive.block");
  EXPECT_EQ(damaged.code, 2);
  EXPECT_TRUE(contains(damaged.err, "its checksum does not match its bytes")) << damaged.err;
  EXPECT_EQ(shell.run("flexspline unpack m.toml").code, 2);
  EXPECT_EQ(shell.run("flexspline unpack not-there").code, 2);
}

}  // namespace
}  // namespace flexspline::cli_test::pack_test
