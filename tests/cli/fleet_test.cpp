// Many drives under a scheduler, and the one that differs.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::fleet_test {
namespace {

constexpr const char* kPlan = R"(format = "flexspline-plan/1"
sample_s = 0.001
[limits]
[[run]]
name = "sine"
mode = "velocity"
waveform = "sine"
amplitude = 100
frequency_hz = 1
duration_s = 4
[[run]]
name = "slow"
mode = "velocity"
waveform = "triangle"
amplitude = 30
frequency_hz = 0.5
duration_s = 4
[[run]]
name = "other"
mode = "velocity"
waveform = "sine"
amplitude = 60
frequency_hz = 2
duration_s = 4
)";

// Eight drives of one kind in drives/, the fifth with twice the Coulomb friction.
void make_fleet(const Shell& shell) {
  shell.write("plan.toml", kPlan);
  std::string plant = content_of(fs::path(FLEXSPLINE_SOURCE_DIR) / "hil/plant/demo-drive.toml");
  const std::size_t effect = plant.find("type = \"coulomb_friction\"");
  const std::size_t value = plant.find("value = ", effect) + std::string("value = ").size();
  std::size_t used = 0;
  const double usual = std::stod(plant.substr(value), &used);
  shell.write("usual.toml", plant);
  shell.write("odd.toml", plant.replace(value, used, std::to_string(2.0 * usual)));
  for (int drive = 1; drive <= 8; ++drive)
    shell.must("flexspline-hil record --plant " + std::string(drive == 5 ? "odd" : "usual") +
               ".toml --plan plan.toml --friction-variation 0.01 --seed " + std::to_string(drive) +
               " --out drives/drive-" + std::to_string(drive));
}

TEST(Fleet, TheDriveThatDiffersIsNamedWithWhatDiffers) {
  const Shell shell;
  make_fleet(shell);
  const bool has_parallel = shell.run("command -v parallel && parallel --version | grep -q GNU").code == 0;
  const std::string out = has_parallel ? shell.must("parallel -j2 flexspline fleet run {} ::: drives/*")
                                       : shell.must("flexspline fleet run drives/*");
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 8) << out;

  const nlohmann::json merged = shell.json("flexspline fleet merge drives");
  EXPECT_EQ(merged["drives"], 8);
  EXPECT_TRUE(merged["failed"].empty());
  ASSERT_FALSE(merged["different"].empty()) << merged.dump(1);
  EXPECT_EQ(merged["different"][0]["drive"], "drive-5");
  EXPECT_EQ(merged["different"][0]["name"], "coulomb_friction.torque");
  EXPECT_GT(merged["different"][0]["z"], 10.0);
  for (const auto& one : merged["different"]) EXPECT_EQ(one["drive"], "drive-5") << one.dump();
  const std::string words = shell.must("flexspline fleet merge drives");
  EXPECT_TRUE(contains(words, "drive-5: coulomb_friction.torque is ")) << words;

  // As an array job of Slurm would: what is done is not done again, what was changed or failed is.
  EXPECT_TRUE(contains(shell.must("SLURM_ARRAY_TASK_ID=2 bash -c 'all=(drives/*); flexspline fleet run "
                                  "\"${all[$SLURM_ARRAY_TASK_ID]}\"'"),
                       "drive-3: done before"));
  shell.must("rm drives/drive-6/*.csv");
  const Answer failed = shell.run("flexspline fleet run drives/drive-6");
  EXPECT_EQ(failed.code, 2);
  const nlohmann::json after = shell.json("flexspline fleet merge drives");
  ASSERT_EQ(after["failed"].size(), 1u);
  EXPECT_EQ(after["failed"][0]["drive"], "drive-6");
}

TEST(Fleet, AJobThatWasKilledOrNeverRanCountsAsADriveWithoutAResult) {
  const Shell shell;
  shell.write("plan.toml", kPlan);
  for (int drive = 1; drive <= 3; ++drive)
    shell.must("flexspline-hil record --plan plan.toml --seed " + std::to_string(drive) + " --out drives/drive-" +
               std::to_string(drive));
  shell.must("flexspline fleet run drives/drive-1");
  // Drive 2 is killed on its way; drive 3 was never begun.
  shell.run("flexspline fleet run --diagnose drives/drive-2 & sleep 0.2; kill -9 $!; wait");
  const nlohmann::json merged = shell.json("flexspline fleet merge drives");
  EXPECT_EQ(merged["drives"], 3);
  ASSERT_EQ(merged["failed"].size(), 2u) << merged.dump(1);
  EXPECT_EQ(merged["failed"][1]["drive"], "drive-3");
  EXPECT_TRUE(contains(shell.must("flexspline fleet merge drives"), "3 drives, 2 of them without a result"));
  // So they do where each folder is named.
  EXPECT_EQ(shell.json("flexspline fleet merge drives/*")["failed"].size(), 2u);
  shell.must("flexspline fleet run drives/*");
  EXPECT_TRUE(shell.json("flexspline fleet merge drives")["failed"].empty());
}

TEST(Fleet, ADriveIsDoneAgainWhereARecordingInAnotherFolderChanged) {
  const Shell shell;
  shell.write("plan.toml", kPlan);
  shell.must("flexspline-hil record --plan plan.toml --seed 1 --out raw");
  shell.must("rm raw/dataset.toml");
  shell.must("flexspline new --from raw --out project");
  shell.must("flexspline fleet run project");
  EXPECT_TRUE(contains(shell.must("flexspline fleet run project"), "done before"));
  shell.must("sed -i 's/^# load: free/# load: free\\n# a comment/' raw/slow.csv && grep -q 'a comment' raw/slow.csv");
  EXPECT_FALSE(contains(shell.must("flexspline fleet run project"), "done before"));
}

TEST(Fleet, SaysWhatIsWrong) {
  const Shell shell;
  EXPECT_EQ(shell.run("flexspline fleet run nowhere").code, 2);
  EXPECT_EQ(shell.run("flexspline fleet start drives").code, 2);
  shell.must("mkdir empty");
  const Answer no_model = shell.run("flexspline fleet run empty");
  EXPECT_EQ(no_model.code, 2);
  EXPECT_TRUE(contains(no_model.err, "base-model.toml")) << no_model.err;
  const Answer nothing = shell.run("flexspline fleet merge empty");
  EXPECT_EQ(nothing.code, 2);
  EXPECT_TRUE(contains(nothing.err, "flexspline fleet run")) << nothing.err;
  shell.write("broken/fleet-result.json", "{\"format\": \"flexspline-fleet");
  const Answer broken = shell.run("flexspline fleet merge broken");
  EXPECT_EQ(broken.code, 2);
  EXPECT_TRUE(contains(broken.err, "broken/fleet-result.json")) << broken.err;
}

}  // namespace
}  // namespace flexspline::cli_test::fleet_test
