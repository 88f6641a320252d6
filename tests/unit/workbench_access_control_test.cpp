// host/app/workbench: who may speak with the server, and which files a request may name.
#include "host/app/workbench/access_control.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

namespace flexspline::workbench::workbench_access_control_test {
namespace {

namespace fs = std::filesystem;
constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

std::string refused(std::string_view host, std::string_view origin, std::string_view path) {
  return refusal({host, origin, path}, kToken, 4711);
}
const std::string kPath = std::string("/") + kToken + "/api/state";

TEST(WorkbenchAccessControl, LetsItsOwnPageIn) {
  EXPECT_EQ(refused("127.0.0.1:4711", "", kPath), "");
  EXPECT_EQ(refused("localhost:4711", "http://127.0.0.1:4711", kPath), "");
  EXPECT_EQ(behind_token(kPath), "/api/state");
}

TEST(WorkbenchAccessControl, RefusesWithoutTheToken) {
  const std::string token = kToken;
  for (const std::string& path :
       {std::string("/"), std::string(""), std::string("/api/state"), std::string("//api/state"), "/" + token,
        "/" + token.substr(1) + "/", "/" + token + "0/", "/" + std::string(32, '0') + "/", "x/" + token + "/"})
    EXPECT_NE(refused("127.0.0.1:4711", "", path), "") << path;
  EXPECT_NE(refusal({"127.0.0.1:4711", "", "//"}, "", 4711), "");
}

TEST(WorkbenchAccessControl, RefusesOtherNamesOfThisMachineAndOtherPages) {
  for (const char* host : {"", "attacker.example", "attacker.example:4711", "127.0.0.1", "127.0.0.1:4712",
                           "127.0.0.1:47110", "127.0.0.1.attacker.example:4711"})
    EXPECT_NE(refused(host, "", kPath), "") << host;
  for (const char* origin : {"null", "http://attacker.example", "https://127.0.0.1:4711", "http://127.0.0.1:4712",
                             "http://127.0.0.1:4711.attacker.example"})
    EXPECT_NE(refused("127.0.0.1:4711", origin, kPath), "") << origin;
}

TEST(WorkbenchAccessControl, MakesTokensThatDiffer) {
  std::set<std::string> tokens;
  for (int k = 0; k < 64; ++k) {
    const std::string token = new_token();
    EXPECT_EQ(token.size(), 32u);
    EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
    tokens.insert(token);
  }
  EXPECT_EQ(tokens.size(), 64u);
}

TEST(WorkbenchAccessControl, TakesPlainFileNamesOnly) {
  const fs::path folder = "some/folder";
  EXPECT_EQ(inside(folder, "better model.toml", ".toml"), folder / "better model.toml");
  for (const char* name :
       {"../x.toml", "/etc/x.toml", "a/b.toml", "a\\b.toml", ".x.toml", "..", "", ".toml", "x.html", "a\nb.toml"})
    EXPECT_THROW(inside(folder, name, ".toml"), NameError) << name;
  EXPECT_THROW(inside(folder, std::string("a\0b.toml", 8), ".toml"), NameError);
  EXPECT_THROW(inside(folder, std::string(200, 'a') + ".toml", ".toml"), NameError);
}

TEST(WorkbenchAccessControl, FollowsNoLinkOutOfTheFolder) {
  std::string name = (fs::temp_directory_path() / "flexspline-access-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path folder = name;
  std::ofstream(folder / "real.toml") << "x";
  fs::create_symlink(folder / "real.toml", folder / "link.toml");
  EXPECT_EQ(inside(folder, "real.toml", ".toml"), folder / "real.toml");
  EXPECT_THROW(inside(folder, "link.toml", ".toml"), NameError);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_access_control_test
