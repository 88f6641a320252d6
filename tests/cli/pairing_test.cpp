// The lock of the parameters by a pairing key, as a user sees it, over each way to a twin.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::pairing_test {
namespace {

using nlohmann::json;

void make_keys(const Shell& shell) {
  shell.must("flexspline key --new owner.key");
  shell.must("flexspline key --new other.key");
}
std::string first_state(const Shell& shell, const std::string& drive) {
  return shell.json("flexspline pair --drive " + drive)["pairing"];
}

TEST(Pair, LocksWhatWritesOverASocketASerialLineAndTheEmbeddedTwin) {
  for (const std::vector<std::string>& line : {std::vector<std::string>{"--serve", "0"}, {"--pty"}, {}}) {
    const Shell shell;
    make_keys(shell);
    std::optional<TwinProcess> twin;
    if (!line.empty()) twin.emplace(line);
    const std::string name = twin ? twin->name() : "twin", drive = " --drive " + name;
    SCOPED_TRACE(name);
    EXPECT_EQ(first_state(shell, name), "not_paired");
    shell.must("flexspline backup --out made.block" + drive);
    const json paired = shell.json("flexspline pair --pairing-key owner.key" + drive);
    EXPECT_TRUE(paired["changed"].get<bool>());
    EXPECT_EQ(paired["pairing"], "locked");
    EXPECT_FALSE(shell.json("flexspline pair --pairing-key owner.key" + drive)["changed"].get<bool>());
    const json seen = shell.json("flexspline drives --also " + name)["drives"].back();
    EXPECT_EQ(seen["pairing"], "locked");
    EXPECT_EQ(seen["pairing_key"], paired["key"]);

    const std::vector<std::string> writes = {"flash --block made.block", "restore --yes",
                                             "restore --factory-reset --yes", "home --position-rad 0 --store",
                                             "monitor --residual-map"};
    for (const std::string& command : writes) {
      const Answer refused = shell.run("flexspline " + command + drive);
      EXPECT_EQ(refused.code, 2) << command;
      EXPECT_TRUE(contains(refused.err, "locked by")) << command << refused.err;
      EXPECT_TRUE(contains(refused.err, "--pairing-key")) << command << refused.err;
      const Answer wrong = shell.run("flexspline " + command + " --pairing-key other.key" + drive);
      EXPECT_EQ(wrong.code, 2) << command;
      EXPECT_TRUE(contains(wrong.err, "it is paired with the key " + paired["key"].get<std::string>()))
          << command << wrong.err;
    }
    shell.must("flexspline home --position-rad 0" + drive);
    shell.must("flexspline monitor --seconds 0.1" + drive);
    shell.must("flexspline backup --out now.block" + drive);
    EXPECT_EQ(shell.file("now.block"), shell.file("made.block"));

    shell.must("flexspline home --position-rad 0 --store --pairing-key owner.key" + drive);
    EXPECT_TRUE(shell.json("flexspline restore --yes --pairing-key owner.key" + drive)["restored"].get<bool>());
    EXPECT_TRUE(
        shell.json("flexspline flash --block made.block --pairing-key owner.key" + drive)["format"].is_string());
    shell.must("flexspline monitor --residual-map --pairing-key owner.key" + drive);
    EXPECT_EQ(first_state(shell, name), "locked") << "each command locks again what it opened";
    EXPECT_TRUE(shell.json("flexspline restore --factory-reset --pairing-key owner.key" + drive)["erased"].get<bool>());
    EXPECT_EQ(first_state(shell, name), "locked") << "a factory reset does not end it";

    const Answer taken = shell.run("flexspline pair --pairing-key other.key" + drive);
    EXPECT_EQ(taken.code, 2);
    EXPECT_TRUE(contains(taken.err, "--old-key")) << taken.err;
    EXPECT_TRUE(
        shell.json("flexspline pair --pairing-key other.key --old-key owner.key" + drive)["changed"].get<bool>());
    EXPECT_EQ(shell.run("flexspline unpair --pairing-key owner.key" + drive).code, 2);
    EXPECT_EQ(shell.json("flexspline unpair --pairing-key other.key" + drive)["pairing"], "not_paired");
  }
}

TEST(Pair, OutlastsAPowerCut) {
  const Shell shell;
  make_keys(shell);
  const std::string flash = (shell.folder() / "twin.flash").string();
  {
    TwinProcess twin({"--serve", "0", "--flash", flash});
    shell.must("flexspline pair --pairing-key owner.key --drive " + twin.name());
    twin.cut_power();
  }
  const TwinProcess twin({"--serve", "0", "--flash", flash});
  EXPECT_EQ(first_state(shell, twin.name()), "locked");
  EXPECT_EQ(shell.run("flexspline restore --factory-reset --yes --drive " + twin.name()).code, 2);
  shell.must("flexspline unpair --pairing-key owner.key --drive " + twin.name());
}

TEST(Pair, SaysWhatIsWrongWithAKeyAndWhatToDo) {
  const Shell shell;
  make_keys(shell);
  shell.write("no.key", "{}");
  shell.must("chmod 600 no.key && cp owner.key open.key && chmod 644 open.key");
  const TwinProcess twin({"--serve", "0", "--serial", "SN-9"});
  const std::string drive = " --drive " + twin.name();
  const auto error_of = [&](const std::string& line) {
    const Answer answer = shell.run("flexspline " + line + drive);
    EXPECT_EQ(answer.code, 2) << line;
    return answer.err;
  };
  EXPECT_TRUE(contains(error_of("pair --pairing-key missing.key"), "missing.key cannot be read; is the path right?"));
  EXPECT_TRUE(contains(error_of("pair --pairing-key no.key"), "no.key is not a file of keys; flexspline key --new"));
  EXPECT_TRUE(contains(error_of("pair --pairing-key open.key"), "chmod 600 open.key"));
  EXPECT_TRUE(contains(error_of("unpair --pairing-key owner.key"), "it is not paired"));
  EXPECT_TRUE(contains(error_of("restore --factory-reset --pairing-key owner.key"), "it is not paired"));
  EXPECT_TRUE(contains(error_of("home --position-rad 0 --pairing-key owner.key"), "--pairing-key is for --store"));
  EXPECT_TRUE(contains(error_of("monitor --pairing-key owner.key"), "--pairing-key is for --residual-map"));
  EXPECT_TRUE(
      contains(error_of("flash --firmware x.image --pairing-key owner.key"), "--pairing-key is for parameters"));
  EXPECT_TRUE(contains(error_of("pair --old-key owner.key"), "--pairing-key"));
}

}  // namespace
}  // namespace flexspline::cli_test::pairing_test
