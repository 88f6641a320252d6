// Firmware images by the commands: made, and refused before a drive is looked for.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test {
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
}  // namespace flexspline::cli_test
