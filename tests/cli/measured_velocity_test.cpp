// A position and a velocity of the same motion: what has less noise is used, and said.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::measured_velocity_test {
namespace {

constexpr double kInertia = 2e-4, kCoulomb = 0.05;

// A position with as much noise as an encoder at the joint has, times the gear; a velocity with little.
std::string log_of(bool with_velocity) {
  std::mt19937 chance(3);
  std::normal_distribution<double> normal;
  std::string text = "# torque_constant_nm_a: 0.1\n# current_hold: none\ntime_s,current_a,motor_position_rad";
  text += with_velocity ? ",motor_velocity_rad_s\n" : "\n";
  for (int k = 0; k < 8000; ++k) {
    const double t = 0.001 * k;
    double angle = 0.0, speed = 0.0, acceleration = 0.0;
    for (const auto& [size, rate] : {std::pair{20.0, 2.0}, {6.0, 61.0}, {4.0, 127.0}}) {
      angle -= size / rate * std::cos(rate * t);
      speed += size * std::sin(rate * t);
      acceleration += size * rate * std::cos(rate * t);
    }
    const double current = (kInertia * acceleration + 1e-3 * speed + kCoulomb * std::tanh(speed / 0.05)) / 0.1;
    char line[160];
    std::snprintf(line, sizeof line, "%.3f,%.9g,%.9g", t, current, angle + 0.02 * normal(chance));
    text += line;
    std::snprintf(line, sizeof line, ",%.9g", speed + 0.05 * normal(chance));
    text += with_velocity ? line : "";
    text += "\n";
  }
  return text;
}

TEST(MeasuredVelocity, KeepsTheInertiaWhereThePositionHasMuchNoiseAndTheFiltersSaySo) {
  const Shell shell;
  shell.write("model.toml",
              "format = \"flexspline-model/1\"\n[drive]\ntorque_constant_nm_a = 0.1\nrated_current_a = 2\n"
              "rated_velocity_rad_s = 200\n[[effect]]\ntype = \"inertia\"\n[[effect]]\ntype = \"viscous_friction\"\n"
              "[[effect]]\ntype = \"coulomb_friction\"\n");
  const auto inertia = [&](bool with_velocity) {
    shell.write("data.csv", log_of(with_velocity));
    const nlohmann::json found = shell.json("flexspline identify data.csv --model model.toml --cutoff-hz 100");
    for (const nlohmann::json& p : found["parameters"])
      if (p["effect"] == "inertia") return p["value"].get<double>();
    return 0.0;
  };
  EXPECT_NEAR(inertia(true), kInertia, 0.05 * kInertia);
  EXPECT_TRUE(contains(shell.must("flexspline check data.csv --cutoff-hz 100"), "measured one above"));
  // Else noise passes for acceleration.
  EXPECT_LT(inertia(false), 0.7 * kInertia);
}

}  // namespace
}  // namespace flexspline::cli_test::measured_velocity_test
