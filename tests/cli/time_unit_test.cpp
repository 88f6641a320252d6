// A time in another unit is named, and no command runs on for hours.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::time_unit_test {
namespace {

std::string log_with_time_in(double unit) {
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < 3000; ++k) {
    const double t = 0.001 * k;
    char line[120];
    std::snprintf(line, sizeof line, "%.9g,%.9g,%.9g\n", t / unit, std::cos(9.0 * t) + 0.3 * std::sin(23.0 * t),
                  20.0 * (1.0 - std::cos(9.0 * t)) + 3.0 * std::sin(23.0 * t));
    text += line;
  }
  return text;
}

TEST(TimeUnit, CommandsThatSimulateEndAndNameIt) {
  const Shell shell;
  shell.write("model.toml",
              "format = \"flexspline-model/1\"\n[drive]\ntorque_constant_nm_a = 0.05\n[[effect]]\ntype = \"inertia\"\n"
              "[effect.parameters]\ninertia = { value = 1e-4 }\n[[effect]]\ntype = \"viscous_friction\"\n"
              "[effect.parameters]\ncoefficient = { value = 1e-3 }\n");
  const std::pair<double, const char*> units[] = {{1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}};
  for (const auto& [unit, name] : units) {
    shell.write("data.csv", log_with_time_in(unit));
    for (const std::string command : {"compare", "sensitivity", "simulate --out simulated"}) {
      const Answer answer = shell.run("timeout 20 flexspline " + command + " --model model.toml data.csv");
      EXPECT_NE(answer.code, 124) << command << " did not end with the time in " << name;
      EXPECT_TRUE(contains(answer.err, std::string("likely ") + name)) << answer.err;
    }
  }
}

}  // namespace
}  // namespace flexspline::cli_test::time_unit_test
