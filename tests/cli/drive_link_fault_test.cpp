// The plug pulled in the middle of each command, after so many of its messages: a clear error, the block is the old or
// the new one, and with the plug in again the same command works.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::drive_link_fault_test {
namespace {

using nlohmann::json;

std::string model_with(double viscous) {
  return "format = \"flexspline-model/1\"\nname = \"by-hand\"\n[drive]\naxis = \"rotary\"\ngear_ratio = 100\n"
         "torque_constant_nm_a = 0.0543\nrated_current_a = 2.0\nrated_velocity_rad_s = 200.0\nrated_torque_nm = 40.0\n"
         "temperature_reference_c = 30.0\n[[effect]]\ntype = \"inertia\"\n[effect.parameters]\n"
         "inertia = { value = 1.04e-4 }\n[[effect]]\ntype = \"viscous_friction\"\n[effect.parameters]\n"
         "coefficient = { value = " +
         std::to_string(viscous) + " }\n";
}

class PulledPlug : public ::testing::Test {
 protected:
  // The twin has done it when this returns.
  void link_fault(const std::string& word) {
    shell_.write("link-fault.new", word + "\n");
    std::filesystem::rename(shell_.folder() / "link-fault.new", shell_.folder() / "link-fault");
    const std::string expected = word.starts_with("out ") ? "in" + word.substr(3) + "\n" : word + "\n";
    for (int i = 0; i < 6000; ++i) {
      if (shell_.file("link-fault.state") == expected) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    FAIL() << "the twin does not follow its link-fault file: " << word;
  }
  Answer tool(const std::string& line) { return shell_.run("flexspline " + line + " --drive " + twin_.name()); }
  // Runs a command whose plug is pulled after `messages` of it.
  Answer cut(const std::string& line, int messages) {
    link_fault("in");
    link_fault("out " + std::to_string(messages));
    const Answer answer = tool(line);
    link_fault("in");
    return answer;
  }
  static void expect_clear(const Answer& answer, const std::string& line) {
    EXPECT_EQ(answer.code, 2) << line << ": " << answer.err;
    EXPECT_TRUE(contains(answer.err, "the drive is gone") || contains(answer.err, "is the twin running?"))
        << line << ": " << answer.err;
  }
  std::string sha() {
    const Answer answer = tool("backup --out now.block --json -");
    EXPECT_EQ(answer.code, 0) << answer.err;
    return answer.code == 0 ? json::parse(answer.out)["block"]["sha256"].get<std::string>() : "";
  }

  Shell shell_;
  TwinProcess twin_{{"--serve", "0", "--link-fault", (shell_.folder() / "link-fault").string()}};
};

TEST_F(PulledPlug, WhileFlashingLeavesTheOldBlockOrTheNewOneAndTheNextTryWorks) {
  shell_.write("made.toml", model_with(3.6e-4));
  shell_.write("other.toml", model_with(4.2e-4));
  ASSERT_EQ(tool("flash --yes --model made.toml").code, 0);
  const std::string made = sha();
  ASSERT_EQ(tool("backup --out made.block").code, 0);
  ASSERT_EQ(tool("flash --yes --model other.toml").code, 0);
  const std::string other = sha();
  ASSERT_EQ(tool("backup --out other.block").code, 0);
  ASSERT_NE(made, other);
  int cuts = 0, old_ones = 0;
  bool whole = false;
  // Until a flash has fewer messages than that.
  for (int messages = 1; !whole && messages < 3000; messages += 1 + messages / 2) {
    const std::string before = sha();
    const std::string wanted = before == made ? "other.block" : "made.block";
    const Answer answer = cut("flash --yes --block " + wanted, messages);
    const std::string after = sha();
    ASSERT_TRUE(after == made || after == other) << "neither block, after " << messages << " messages";
    whole = answer.code == 0;
    if (whole) {
      EXPECT_NE(after, before);
      break;
    }
    ++cuts;
    old_ones += after == before ? 1 : 0;
    expect_clear(answer, "flash, " + std::to_string(messages));
    ASSERT_EQ(tool("flash --yes --block " + wanted).code, 0) << "the next try";
    EXPECT_NE(sha(), before);
  }
  EXPECT_TRUE(whole);
  EXPECT_GE(cuts, 5);
  std::printf("plug pulled in %d flashes: %d times the old block\n", cuts, old_ones);
  for (const int messages : {1, 3}) {
    const std::string before = sha();
    const Answer answer = cut("restore --yes", messages);
    if (answer.code != 0) expect_clear(answer, "restore");
    const std::string after = sha();
    EXPECT_TRUE(after == made || after == other);
    EXPECT_EQ(tool("restore --yes").code, 0);
    EXPECT_NE(sha(), after) << before;
  }
}

TEST_F(PulledPlug, InDrivesBackupMonitorAndRecordIsAClearErrorAndTheNextTryWorks) {
  shell_.write("plan.toml",
               "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[[run]]\nname = \"run\"\nmode = \"velocity\"\n"
               "waveform = \"sine\"\namplitude = 50\nfrequency_hz = 2\nduration_s = 1\n");
  const std::string drives = "flexspline drives --json - --also " + twin_.name();
  link_fault("out 1");
  const Answer found = shell_.run(drives);
  link_fault("in");
  ASSERT_EQ(found.code, 0) << found.err;
  EXPECT_FALSE(json::parse(found.out)["drives"].back()["usable"].get<bool>());
  EXPECT_TRUE(contains(json::parse(found.out)["drives"].back()["problem"].get<std::string>(), "gone")) << found.out;
  EXPECT_TRUE(json::parse(shell_.must(drives))["drives"].back()["usable"].get<bool>());

  for (const int messages : {1, 2, 20}) {
    expect_clear(cut("backup --out no.block", messages), "backup");
    EXPECT_TRUE(shell_.file("no.block").empty()) << "no half of a file";
    EXPECT_FALSE(sha().empty());
  }
  // The last one goes on until something happens: the subscription is the last that it asks for, so the plug is pulled
  // when that was taken.
  int before_it_streams = 0;
  for (int messages = 2; before_it_streams == 0 && messages < 2000; messages += 40) {
    const Answer answer = cut("monitor --seconds 0.3", messages);
    if (answer.code == 0) {
      before_it_streams = messages;
    } else {
      expect_clear(answer, "monitor");
    }
  }
  EXPECT_GT(before_it_streams, 2);
  EXPECT_EQ(tool("monitor --seconds 0.2").code, 0);

  // It reads the block twice, so that this many messages are beyond the arming; then one comes each 20 ms, and the
  // motion is long. The drive is in a fault afterwards: its host disconnected while it was armed.
  std::string longer = shell_.file("plan.toml");
  longer.replace(longer.find("duration_s = 1"), 14, "duration_s = 60");
  shell_.write("long.toml", longer);
  const Answer recorded = cut("record --plan long.toml --out cut", 2 * before_it_streams + 40);
  expect_clear(recorded, "record");
  EXPECT_TRUE(contains(recorded.err, "0 of 1 runs are in cut")) << recorded.err;
  Answer fault;
  // It takes the drive 0.1 s to miss its host, and some more to come to rest.
  for (int i = 0; i < 200 && !contains(fault.err, "--clear-fault"); ++i)
    fault = tool("record --plan plan.toml --out again");
  EXPECT_EQ(fault.code, 2);
  EXPECT_TRUE(contains(fault.err, "--clear-fault")) << fault.err;
  EXPECT_EQ(tool("record --clear-fault --force --plan plan.toml --out again").code, 0);
}

}  // namespace
}  // namespace flexspline::cli_test::drive_link_fault_test
