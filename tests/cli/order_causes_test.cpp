// A ripple that the twin hides, whose order is one of its motor: diagnose says what makes it, as text and as JSON.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::order_causes_test {
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

// Writes the base model of a recording with these lines below [drive].
void state(const Shell& shell, const std::string& facts) {
  std::string text = shell.file("demo-out/base-model.toml");
  const std::size_t end = text.find('\n', text.find("[drive]"));
  shell.write("model.toml", text.insert(end + 1, facts));
}

TEST(OrderCausesOfARecording, ARippleOfSixTimesThePolePairsIsDeadTimeOrBackEmf) {
  const Shell shell;
  shell.record("torque_ripple:24");
  state(shell, "pole_pairs = 4\nmotor_slots = 18\n");
  const std::string text = in_one_line(shell.must("flexspline diagnose --model model.toml demo-out --json found.json"));
  const json found = json::parse(shell.file("found.json"));
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

  EXPECT_TRUE(contains(text, "On this drive 24 per motor turn is the order of:")) << text;
  EXPECT_TRUE(contains(text, "dead time of the inverter")) << text;
  EXPECT_TRUE(contains(text, "Cure: Switch the dead-time compensation on")) << text;

  // The facts stay in every model that comes of this one.
  shell.must("flexspline add torque_ripple:24 --model model.toml demo-out --out better.toml");
  for (const char* fact : {"pole_pairs = 4\n", "motor_slots = 18\n"})
    EXPECT_TRUE(contains(shell.file("better.toml"), fact)) << fact;
  shell.must("flexspline pack --model better.toml --out drive.block");
}

TEST(OrderCausesOfARecording, WithoutThePolePairsTheHintSaysWhatToState) {
  const Shell shell;
  shell.record("torque_ripple:24");
  state(shell, "");
  const json ripple = candidate_of(
      shell.json("flexspline diagnose --model model.toml demo-out/free-slow-warm.csv demo-out/free-sine-0.3hz-warm.csv "
                 "demo-out/free-sine-1hz.csv demo-out/rest.csv"),
      24.0);
  EXPECT_EQ(ripple["order_causes"], json::array());
  EXPECT_TRUE(contains(ripple["order_hint"].get<std::string>(), "pole_pairs and motor_slots"));
  const Answer refused = [&] {
    state(shell, "pole_pairs = 3.5\n");
    return shell.run("flexspline diagnose --model model.toml demo-out");
  }();
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "pole_pairs = 3.5 is not a whole number")) << refused.err;
}

// Dead time of seven pole pairs makes order 42, and 24 orders are tried without a fact of the motor.
// tried.
TEST(OrderCausesOfARecording, AnOrderBeyondTwentyFourIsFoundWhereThePolePairsGiveIt) {
  const Shell shell;
  const auto run = [](const char* name, const char* waveform, const char* amplitude, const char* hz) {
    return std::string("[[run]]\nname = \"") + name + "\"\nmode = \"velocity\"\nwaveform = \"" + waveform +
           "\"\namplitude = " + amplitude + "\nfrequency_hz = " + hz + "\nduration_s = 20\n";
  };
  shell.write("plan.toml", "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\nvelocity_rad_s = 150\n" +
                               run("slow", "triangle", "6", "0.1") + run("slower", "triangle", "4", "0.1") +
                               run("sine", "sine", "8", "0.2"));
  shell.must("flexspline-hil record --plan plan.toml --out demo-out --seed 3 --hide torque_ripple:42");
  state(shell, "");
  for (const json& c : shell.json("flexspline diagnose --model model.toml demo-out")["candidates"])
    EXPECT_NE(c["order"], 42.0) << "not tried without the fact";
  state(shell, "pole_pairs = 7\n");
  const json found = shell.json("flexspline diagnose --model model.toml demo-out");
  ASSERT_FALSE(found["named"].empty());
  EXPECT_EQ(found["named"][0]["effect"], "torque_ripple");
  EXPECT_EQ(found["named"][0]["order"], 42.0);
  const json ripple = candidate_of(found, 42.0);
  ASSERT_EQ(ripple["order_causes"].size(), 2U);
  EXPECT_EQ(ripple["order_causes"][0]["from"], "6 x pole_pairs = 42");
}

}  // namespace
}  // namespace flexspline::cli_test::order_causes_test
