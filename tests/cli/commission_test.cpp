// The command `commission` on the twin with a three-phase motor: what it finds, what it names, and what ends it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <tuple>
#include <vector>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::commission_test {
namespace {

using nlohmann::json;

std::vector<std::string> words(const std::vector<std::string>& more) {
  std::vector<std::string> all{"--serve", "0", "--fast", "--motor", "three-phase"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}
double value_of(const json& answer, const std::string& name) {
  for (const json& v : answer["result"])
    if (v["name"] == name) return v["value"];
  ADD_FAILURE() << "no " << name << " in " << answer.dump();
  return 0.0;
}
// Whatever its exit code.
json answer_of(const Shell& shell, const std::string& line, int code) {
  const Answer answer = shell.run(line + " --json -");
  EXPECT_EQ(answer.code, code) << line << answer.err;
  return json::parse(answer.out, nullptr, false);
}

// A question is asked on a terminal only; script is one.
TEST(Commission, WritesItsJsonAlsoWhereThePersonDeclines) {
  const Shell shell;
  const TwinProcess twin(words({}));
  const Answer answer = shell.run("printf 'n\\n' | script -qec 'flexspline commission --json no.json --drive " +
                                  twin.name() + "' /dev/null");
  EXPECT_EQ(answer.code, 0) << answer.err;
  EXPECT_TRUE(contains(answer.out, "Nothing was moved")) << answer.out;
  const json no = json::parse(shell.file("no.json"), nullptr, false);
  EXPECT_EQ(no["format"], "flexspline-commission/1");
  EXPECT_EQ(no["end"], "none");
  EXPECT_EQ(no["runs"], 0);
  EXPECT_FALSE(no["stored"].get<bool>());
  EXPECT_TRUE(no["result"].is_null());
}

TEST(Commission, FindsTheMotorOfTheTwinKeepsItAndTheDriveFollowsAfterAPowerCut) {
  for (const int seed : {1, 2}) {
    const Shell shell;
    const std::string flash = (shell.folder() / "flash").string(), number = std::to_string(seed);
    const auto start = words({"--motor-seed", number, "--flash", flash});
    const json truth = json::parse(shell.must("flexspline-hil motor --seed " + number));
    {
      const TwinProcess twin(start);
      const json found = answer_of(shell, "flexspline commission --store --yes --repeat 2 --drive " + twin.name(), 0);
      EXPECT_EQ(found["end"], "done");
      EXPECT_TRUE(found["stored"].get<bool>());
      EXPECT_TRUE(found["fault"].is_null());
      expect_fields(found,
                    {"format", "drive", "test", "step", "seconds", "runs", "result", "current_loop", "warnings"});
      const auto of = [&](const char* name) { return truth[name].get<double>(); };
      double inverse = 0.0;
      for (const json& g : truth["current_gain"]) inverse += 1.0 / g.get<double>();
      const double gain = 3.0 / inverse;  // what all sensors have in common
      const auto share = [&](const char* name, double scale, double true_value) {
        const double off = value_of(found, name) * scale / true_value - 1.0;
        std::printf("seed %d: %s %+.2f %%\n", seed, name, 100.0 * off);
        return off;
      };
      EXPECT_NEAR(share("resistance", gain, of("resistance_ohm") + of("switch_ohm")), 0.0, 0.03);
      EXPECT_NEAR(share("inductance_d", gain, of("inductance_d_h")), 0.0, 0.05);
      EXPECT_NEAR(share("inductance_q", gain, of("inductance_q_h")), 0.0, 0.05);
      EXPECT_NEAR(share("flux_linkage", 1.0, of("flux_vs")), 0.0, 0.02);
      EXPECT_EQ(value_of(found, "pole_pairs"), of("pole_pairs"));
      EXPECT_EQ(value_of(found, "encoder_direction"), truth["phases_swapped"].get<bool>() ? -1.0 : 1.0);
      // Two runs, so that the spread is known.
      for (const json& v : found["result"]) EXPECT_TRUE(v["spread"].is_number()) << v.dump();
    }
    const TwinProcess again(start);
    shell.write("plan.toml",
                "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\nvelocity_rad_s = 150\n[[run]]\n"
                "name = \"sine\"\nmode = \"velocity\"\nwaveform = \"sine\"\namplitude = 60\nfrequency_hz = 1\n"
                "duration_s = 2\n");
    shell.must("flexspline record --plan plan.toml --out recorded --drive " + again.name());
    // Flashing another model does not lose the motor.
    shell.must("flexspline-hil data-sheet --out sheet");
    shell.must("flexspline flash --yes --model sheet/known-model.toml --drive " + again.name());
    shell.must("flexspline record --plan plan.toml --out recorded-again --drive " + again.name());
  }
}

TEST(Commission, NamesEachWiringFaultAndEndsWithCodeOne) {
  for (const auto& [fault, named, phase] :
       std::vector<std::tuple<std::string, std::string, std::string>>{{"phase-open-b", "phase_open", "b"},
                                                                      {"sensors-swapped", "sensor_order", ""},
                                                                      {"short-to-ground-c", "short_to_ground", "c"},
                                                                      {"encoder-slips", "encoder_slips", ""},
                                                                      {"encoder-stands", "encoder_stands", ""},
                                                                      {"bus-low", "bus_too_low", ""}}) {
    const Shell shell;
    const TwinProcess twin(words({"--motor-seed", "1", "--wiring-fault", fault}));
    const json answer = answer_of(shell, "flexspline commission --store --yes --drive " + twin.name(), 1);
    EXPECT_EQ(answer["end"], "fault") << fault;
    EXPECT_EQ(answer["fault"]["name"], named) << fault;
    if (!phase.empty()) {
      EXPECT_EQ(answer["fault"]["phase"], phase) << fault;
    }
    EXPECT_FALSE(answer["stored"].get<bool>()) << fault;
    EXPECT_FALSE(answer["fault"]["cure"].get<std::string>().empty()) << fault;
  }
}

TEST(Commission, OtherPolePairsThanStatedAreNamed) {
  const Shell shell;
  const TwinProcess twin(words({"--motor-seed", "1"}));
  const json answer = answer_of(shell, "flexspline commission --yes --pole-pairs 9 --drive " + twin.name(), 1);
  EXPECT_EQ(answer["fault"]["name"], "wrong_pole_pairs");
}

TEST(Commission, AHostThatIsKilledLeavesADriveThatIsOffAndReadyAgain) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0", "--motor", "three-phase", "--motor-seed", "1"});  // in real time
  const Answer killed = shell.run("timeout -s KILL 2 flexspline commission --yes --drive " + twin.name());
  EXPECT_NE(killed.code, 0);
  const json stopped = shell.json("flexspline monitor --seconds 0.1 --drive " + twin.name());
  EXPECT_TRUE(contains(stopped.dump(), "idle")) << stopped.dump();
  const Answer interrupted = shell.run("timeout -s INT 2 flexspline commission --yes --drive " + twin.name());
  EXPECT_TRUE(contains(interrupted.out, "stopped")) << interrupted.out << interrupted.err;
  EXPECT_TRUE(contains(interrupted.out, "All switches are open")) << interrupted.out;
}

TEST(Commission, ADriveWithoutAStageWrongNumbersAndALockedDriveAreExplained) {
  const Shell shell;
  const Answer none = shell.run("flexspline commission --yes --drive twin");
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(contains(none.err, "no three-phase power stage")) << none.err;
  const TwinProcess twin(words({"--motor-seed", "1"}));
  const std::string drive = " --drive " + twin.name();
  const Answer current = shell.run("flexspline commission --yes --test-current-a 9" + drive);
  EXPECT_EQ(current.code, 2);
  EXPECT_TRUE(contains(current.err, "give at most")) << current.err;
  const Answer little = shell.run("flexspline commission --yes --test-current-a 0.01" + drive);
  EXPECT_EQ(little.code, 2);
  EXPECT_TRUE(contains(little.err, "too little to measure with")) << little.err;
  const Answer fast = shell.run("flexspline commission --yes --bandwidth-hz 9000" + drive);
  EXPECT_EQ(fast.code, 2);
  EXPECT_TRUE(contains(fast.err, "--bandwidth-hz 9000")) << fast.err;
  shell.must("flexspline key --new owner.key");
  shell.must("flexspline pair --pairing-key owner.key" + drive);
  const Answer locked = shell.run("flexspline commission --yes" + drive);
  EXPECT_EQ(locked.code, 2);
  EXPECT_TRUE(contains(locked.err, "locked by")) << locked.err;
  const json opened = answer_of(shell, "flexspline commission --yes --store --pairing-key owner.key" + drive, 0);
  EXPECT_TRUE(opened["stored"].get<bool>());
}

}  // namespace
}  // namespace flexspline::cli_test::commission_test
