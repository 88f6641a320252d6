// What `unpack` says of a parameter block of an earlier version is what it said then.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::golden_block_test {
namespace {

using nlohmann::json;

// Numbers may differ in the last digits: the file has them as text.
void expect_same(const json& now, const json& then, const std::string& where) {
  if (then.is_number() && now.is_number()) {
    EXPECT_NEAR(now.get<double>(), then.get<double>(), 1e-12 * std::abs(then.get<double>())) << where;
  } else if (then.is_object()) {
    for (const auto& [key, value] : then.items()) {
      ASSERT_TRUE(now.contains(key)) << where << "/" << key;
      expect_same(now[key], value, where + "/" + key);
    }
  } else if (then.is_array()) {
    // Settings that are listed now and were not then come after the others.
    if (where == "/settings") {
      ASSERT_GE(now.size(), then.size()) << where;
    } else {
      ASSERT_EQ(now.size(), then.size()) << where;
    }
    for (std::size_t i = 0; i < then.size(); ++i) expect_same(now[i], then[i], where + "/" + std::to_string(i));
  } else {
    EXPECT_EQ(now, then) << where;
  }
}

TEST(GoldenBlock, OfVersion1SaysWhatItSaidWhenItWasWritten) {
  const Shell shell;
  const std::string folder = std::string(FLEXSPLINE_SOURCE_DIR) + "/tests/unit/golden/parameter_block_v1_drive";
  std::ifstream in(folder + ".hex");
  std::string block;
  for (std::string line; std::getline(in, line);)
    for (std::size_t i = 0; i + 1 < line.size(); i += 2)
      block += static_cast<char>(std::stoi(line.substr(i, 2), nullptr, 16));
  ASSERT_FALSE(block.empty());
  shell.write("old.block", block);
  shell.must("flexspline unpack old.block --json now.json");
  expect_same(json::parse(shell.file("now.json")), json::parse(std::ifstream(folder + ".json")), "");
}

}  // namespace
}  // namespace flexspline::cli_test::golden_block_test
