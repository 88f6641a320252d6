// Firmware images by the commands: made, and refused before a drive is looked for.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::firmware_test {
namespace {

TEST(Firmware, AnImageIsMadeOfAProgram) {
  const Shell shell;
  shell.must("echo program >program.bin");
  const std::string said =
      shell.must("flexspline image --program program.bin --board stm32f405 --version 1.2 --out firmware.image");
  EXPECT_TRUE(contains(said, "firmware 1.2 for board stm32f405, 520 bytes")) << said;
  const Answer version = shell.run("flexspline image --program program.bin --board b --version 1 --out other.image");
  EXPECT_EQ(version.code, 2);
  EXPECT_TRUE(contains(version.err, "'1' is no version")) << version.err;
  const Answer missing = shell.run("flexspline image --program none.bin --board b --version 1.0 --out other.image");
  EXPECT_EQ(missing.code, 2);
  EXPECT_TRUE(contains(missing.err, "none.bin cannot be read")) << missing.err;
}

TEST(Firmware, AnImageIsSignedByAKeyOfItsOwnOrTheDevelopmentKeyAndSaysSo) {
  const Shell shell;
  shell.must("echo program >program.bin; echo");
  const std::string image = "flexspline image --program program.bin --board b --version 1.0 ";
  EXPECT_TRUE(contains(shell.must(image + "--out dev.image"), "signed with the development key, which is public"));
  EXPECT_TRUE(contains(shell.must(image + "--out plain.image --unsigned"), "not signed"));
  const std::string made = shell.must("flexspline key --new own.key");
  const std::string key = shell.must("flexspline key --show own.key");
  ASSERT_EQ(key.size(), 65U) << "64 digits and the end of the line";
  EXPECT_TRUE(contains(made, key.substr(0, 64))) << made;
  EXPECT_EQ(shell.must("stat -c %a own.key"), "600\n");
  const std::string said = shell.must("flexspline sign --image plain.image --key own.key --counter 3 --out own.image");
  EXPECT_TRUE(contains(said, key.substr(0, 16))) << said;
  EXPECT_TRUE(contains(said, "security counter 3")) << said;
  // Ed25519 has one signature for a message and a key.
  shell.must(image + "--key own.key --counter 3 --out same.image");
  shell.must("cmp own.image same.image; echo");
  EXPECT_FALSE(contains(shell.must("cat own.image | tr -d '\\000' | head -c 300"), "secret"));
  for (const char* wrong :
       {"flexspline key --new own.key", "flexspline key", "flexspline key --show plain.image",
        "flexspline sign --image program.bin --key own.key --out x.image",
        "flexspline image --program program.bin --board b --version 1.0 --out x.image --unsigned --counter 1",
        "flexspline image --program program.bin --board b --version 1.0 --out x.image --counter 65536"}) {
    const Answer answer = shell.run(wrong);
    EXPECT_EQ(answer.code, 2) << wrong;
    EXPECT_FALSE(answer.err.empty()) << wrong;
  }
}

TEST(Firmware, AFileThatIsNoWholeImageIsRefusedBeforeADriveIsLookedFor) {
  const Shell shell;
  shell.must("flexspline-hil image --minor 2 --out good.image");
  shell.must("head -c 9000 good.image >short.image; echo");
  shell.must("{ head -c 9000 good.image; printf X; tail -c +9002 good.image; } >bad.image; echo");
  shell.must(": >empty.image; echo");
  const auto refused = [&](const std::string& file, const char* why) {
    const Answer answer = shell.run("flexspline flash --firmware " + file);
    EXPECT_EQ(answer.code, 2) << file;
    EXPECT_TRUE(contains(answer.err, file)) << answer.err;
    EXPECT_TRUE(contains(answer.err, why)) << answer.err;
  };
  refused("short.image", "is truncated");
  refused("bad.image", "is damaged");
  refused("empty.image", "is empty");
  refused("none.image", "cannot be read");
  const Answer socket = shell.run("flexspline flash --firmware good.image --drive tcp:127.0.0.1:1");
  EXPECT_EQ(socket.code, 2);
  EXPECT_TRUE(contains(socket.err, "over USB alone")) << socket.err;
  const Answer both = shell.run("flexspline flash --firmware good.image --block x.block");
  EXPECT_EQ(both.code, 2);
  EXPECT_TRUE(contains(both.err, "--firmware goes alone")) << both.err;
}

}  // namespace
}  // namespace flexspline::cli_test::firmware_test
