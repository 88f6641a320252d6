// A ripple that the twin hides, whose order is one of its motor: diagnose says what makes it, as text and as JSON.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test {
namespace {

using nlohmann::json;

// Line ends and indentation do not count.
std::string in_one_line(const std::string& text) {
  std::string line;
  for (const char c : text)
    if (c != '\n' && (c != ' ' || line.empty() || line.back() != ' '))
      line += c;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  return line;
}

json candidate_of(const json& found, double order) {
  for (const json& c : found["candidates"])
    if (c["effect"] == "torque_ripple" && c["order"] == order) return c;
  ADD_FAILURE() << found["named"];
  return {};
}

struct Recorded {
  Shell shell;
  Recorded() { shell.record("torque_ripple:24"); }
  // The base model with these lines below [drive].
  void model(const std::string& facts) const {
    std::string text = shell.file("demo-out/base-model.toml");
    const std::string head = "[drive]";
    const std::size_t end = text.find('\n', text.find(head));
    shell.write("model.toml", text.insert(end + 1, facts));
  }
};

TEST(OrderCausesOfARecording, ARippleOfSixTimesThePolePairsIsDeadTimeOrBackEmf) {
  const Recorded twin;
  twin.model("pole_pairs = 4\nmotor_slots = 18\n");
  const json found = twin.shell.json("flexspline diagnose --model model.toml demo-out");
  ASSERT_FALSE(found["named"].empty());
  EXPECT_EQ(found["named"][0]["effect"], "torque_ripple");
  EXPECT_EQ(found["named"][0]["order"], 24.0);
  const json ripple = candidate_of(found, 24.0);
  ASSERT_EQ(ripple["order_causes"].size(), 2U) << ripple["order_causes"];
  for (const json& one : ripple["order_causes"]) {
    expect_fields(one, {"cause", "check", "cure", "from", "reference"});
    EXPECT_EQ(one["from"], "6 x pole_pairs = 24");
  }
  EXPECT_TRUE(contains(ripple["order_causes"][0]["cause"].get<std::string>(), "dead time of the inverter"));
  EXPECT_TRUE(contains(ripple["order_causes"][1]["cause"].get<std::string>(), "back-EMF"));
  EXPECT_TRUE(ripple["order_hint"].is_null());

  const std::string text = in_one_line(twin.shell.must("flexspline diagnose --model model.toml demo-out"));
  EXPECT_TRUE(contains(text, "On this drive 24 per motor turn is the order of:")) << text;
  EXPECT_TRUE(contains(text, "dead time of the inverter")) << text;
  EXPECT_TRUE(contains(text, "Cure: Switch the dead-time compensation on")) << text;

  // The facts stay in every model that comes of this one.
  twin.shell.must("flexspline add torque_ripple:24 --model model.toml demo-out --out better.toml");
  for (const char* fact : {"pole_pairs = 4\n", "motor_slots = 18\n"})
    EXPECT_TRUE(contains(twin.shell.file("better.toml"), fact)) << fact;
  twin.shell.must("flexspline pack --model better.toml --out drive.block");
}

TEST(OrderCausesOfARecording, WithoutThePolePairsTheHintSaysWhatToState) {
  const Recorded twin;
  twin.model("");
  const json ripple = candidate_of(twin.shell.json("flexspline diagnose --model model.toml demo-out"), 24.0);
  EXPECT_EQ(ripple["order_causes"], json::array());
  EXPECT_TRUE(contains(ripple["order_hint"].get<std::string>(), "pole_pairs and motor_slots"));
  const Answer refused = [&] {
    twin.model("pole_pairs = 3.5\n");
    return twin.shell.run("flexspline diagnose --model model.toml demo-out");
  }();
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "pole_pairs = 3.5 is not a whole number")) << refused.err;
}

}  // namespace
}  // namespace flexspline::cli_test
