// What makes ripples in a three-phase motor, hidden in motors that are drawn, through the whole chain: commission,
// record, identify, diagnose. The answer names a ripple of the right order, with its cause and cure. As most drives,
// these have no torque sensor. Seeds 301 to 305 were used while this was written.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/free_motions.hpp"
#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"
#include "tests/support/campaign_size.hpp"

namespace flexspline::cli_test::motor_ripples_test {
namespace {

using nlohmann::json;

struct Hidden {
  const char* name;
  double (*order)(double pole_pairs, double slots);
  const char* cause;
};
const Hidden kHidden[] = {
    {"current-offset", [](double pairs, double) { return pairs; }, "a current sensor has an offset"},
    {"cogging",
     [](double pairs, double slots) {
       return static_cast<double>(std::lcm(static_cast<long>(slots), static_cast<long>(2 * pairs)));
     },
     "cogging: the magnets pull at the teeth"},
    {"cogging-magnet", [](double, double slots) { return slots; }, "cogging by magnets that differ"},
    {"current-gain", [](double pairs, double) { return 2 * pairs; }, "the gains of the current sensors differ"},
    {"encoder-eccentricity", [](double, double) { return 1.0; }, "the motor's encoder is eccentric"},
};

struct Answered {
  json found;
  double pole_pairs = 0.0, slots = 0.0;
};
Answered diagnosed(const std::string& hidden, int seed) {
  const Shell shell;
  const std::string number = std::to_string(seed);
  Answered a;
  const json motor = json::parse(shell.must("flexspline-hil motor --seed " + number));
  a.pole_pairs = motor["pole_pairs"];
  a.slots = motor["slots"];
  std::vector<std::string> words{"--serve", "0",           "--fast",       "--seed", number,
                                 "--motor", "three-phase", "--motor-seed", number};
  if (!hidden.empty()) words.insert(words.end(), {"--motor-ripple", hidden});
  const TwinProcess twin(words);
  shell.write("plan.toml", free_motions());
  shell.must("flexspline commission --store --yes --drive " + twin.name());
  shell.must("flexspline record --plan plan.toml --out free --drive " + twin.name());
  leave_out_torque(shell, "free");
  shell.must("flexspline-hil data-sheet --out sheet");
  std::string model = shell.file("sheet/known-model.toml");
  model.insert(model.find('\n', model.find("[drive]")) + 1,
               "pole_pairs = " + std::to_string(static_cast<int>(a.pole_pairs)) +
                   "\nmotor_slots = " + std::to_string(static_cast<int>(a.slots)) + "\n");
  shell.write("model.toml", model);
  shell.must("flexspline identify --model model.toml --out base.toml free");
  a.found = shell.json("flexspline diagnose --model base.toml free");
  return a;
}

bool is_ripple(const json& named) {
  return !named["order"].is_null();
}
// The named ripple of that order gives the cause, and a cure.
bool is_right(const Answered& a, const Hidden& hidden) {
  const double order = hidden.order(a.pole_pairs, a.slots);
  for (const json& named : a.found["named"]) {
    if (!is_ripple(named) || named["order"] != order) continue;
    for (const json& c : a.found["candidates"])
      if (c["effect"] == named["effect"] && c["order"] == order)
        for (const json& one : c["order_causes"])
          if (one["cause"].get<std::string>().starts_with(hidden.cause) && !one["cure"].get<std::string>().empty())
            return true;
  }
  return false;
}
struct Tally {
  int right = 0, others = 0, cases = 0;  // others: names that are not the hidden one
};
Tally tally(const Hidden& hidden, int first, int motors) {
  Tally t;
  for (int seed = first; seed < first + motors; ++seed) {
    const Answered a = diagnosed(hidden.name, seed);
    const bool right = is_right(a, hidden);
    ++t.cases;
    t.right += right ? 1 : 0;
    t.others += static_cast<int>(a.found["named"].size()) - (right ? 1 : 0);
    std::printf("%s, motor %d (%g pole pairs, %g slots): %s %s\n", hidden.name, seed, a.pole_pairs, a.slots,
                right ? "right," : "missed,", a.found["named"].dump().c_str());
  }
  std::printf("%s: %d of %d named right, %d other names\n", hidden.name, t.right, t.cases, t.others);
  return t;
}

// In ./dev test one motor with one of them; in the whole campaign six motors with each of all.
TEST(MotorRipples, OfMotorsThatAreDrawnAreNamedWithTheirOrderCauseAndCure) {
  const int motors = tests::in_campaign(1, 6);
  Tally all;
  for (const Hidden& hidden : kHidden) {
    if (&hidden - kHidden >= 1 && !tests::whole_campaigns()) continue;
    const Tally t = tally(hidden, 501, motors);
    EXPECT_GE(t.right, 1) << hidden.name;
    all.right += t.right;
    all.cases += t.cases;
  }
  EXPECT_GE(4 * all.right, 3 * all.cases);
}

TEST(MotorRipples, NothingIsNamedInMotorsWithNothingAndNoRippleWhereTheMeasuredCurrentHasIt) {
  // Dead time: the current has the ripple and makes its torque, so nothing of that torque is missing.
  for (int seed = 501; seed < 501 + tests::in_campaign(1, 6); ++seed)
    for (const char* hidden : {"", "dead-time"}) {
      if (*hidden != '\0' && !tests::whole_campaigns()) continue;
      const Answered a = diagnosed(hidden, seed);
      std::printf("nothing but '%s' hidden, motor %d: %s\n", hidden, seed, a.found["named"].dump().c_str());
      for (const json& named : a.found["named"]) EXPECT_FALSE(is_ripple(named)) << hidden << named;
      if (*hidden == '\0') {
        EXPECT_EQ(a.found["named"], json::array());
      }
    }
}

}  // namespace
}  // namespace flexspline::cli_test::motor_ripples_test
