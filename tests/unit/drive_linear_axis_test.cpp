// What the host says of a drive on a linear axis: m, m/s and N in place of rad, rad/s and N m.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/drive_link/drive/position_motion.hpp"
#include "host/drive_link/drive/residual_map_json.hpp"

namespace flexspline::drive::drive_linear_axis_test {
namespace {

using protocol::Channel;

Scales scales_of_axis(bool is_linear) {
  Scales scales{};
  scales.header.axis = is_linear ? 1 : 0;
  scales.constants.gear_ratio = 1.0;
  return scales;
}

TEST(LinearAxis, ChannelsAreInMetresAndNewtons) {
  const Scales linear = scales_of_axis(true), rotary = scales_of_axis(false);
  EXPECT_EQ(linear.unit(Channel::velocity), "m/s");
  EXPECT_EQ(linear.unit(Channel::acceleration), "m/s^2");
  EXPECT_EQ(linear.unit(Channel::disturbance), "N");
  EXPECT_EQ(linear.unit(Channel::torsion), "m");
  EXPECT_EQ(linear.unit(Channel::current), "A");
  EXPECT_EQ(linear.unit(Channel::motor_turns), "turns");
  EXPECT_EQ(rotary.unit(Channel::velocity), "rad/s");
  EXPECT_EQ(rotary.unit(Channel::disturbance), "N*m");
}

TEST(LinearAxis, TheResidualMapNamesItsUnits) {
  ResidualMap map;
  map.edges_rad_s = {0.1};
  map.angle_bins = 1;
  map.bins.resize(3);
  EXPECT_EQ(map_json(map, {}, 0.1)["unit"], "N*m");
  EXPECT_EQ(map_json(map, {}, 0.1)["velocity_unit"], "rad/s");
  map.is_linear = true;
  EXPECT_EQ(map_json(map, {}, 0.1)["unit"], "N");
  EXPECT_EQ(map_json(map, {}, 0.1)["velocity_unit"], "m/s");
}

std::string refusal(bool is_linear, const planning::Limits& limits) {
  planning::Run run;
  run.name = "far";
  run.mode = planning::Mode::position;
  run.waveform = planning::Waveform::sine;
  run.amplitude = 0.2;
  run.frequency_hz = 1.0;
  run.duration_s = 2.0;
  const Scales scales = scales_of_axis(is_linear);
  try {
    const PositionMotion motion(run, limits, scales);
  } catch (const planning::PlanError& error) {
    return error.what();
  }
  return "";
}

TEST(LinearAxis, APlanBeyondItsLimitsIsRefusedInMetres) {
  planning::Limits travel, velocity;
  travel.travel_rad = 0.1;
  velocity.velocity_rad_s = 0.5;
  EXPECT_EQ(
      refusal(true, travel),
      "run \"far\": it moves the output by 0.4 m, beyond the plan's limit of 0.1 m; lower its amplitude or offset "
      "(metres)");
  EXPECT_NE(refusal(true, velocity).find(" m/s, beyond the plan's limit of 0.5; lower its amplitude (metres)"),
            std::string::npos)
      << refusal(true, velocity);
  EXPECT_NE(refusal(false, travel).find("it turns the output by 0.4 rad"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::drive::drive_linear_axis_test
