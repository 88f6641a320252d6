// Draws a robot-like twin: the joint, what is hidden in it, the dirt on its signals, and its records.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/worlds/joint.hpp"

namespace flexspline::worlds {

// `robot_like` draws from the whole range; the others hold one thing.
inline constexpr std::array<std::string_view, 10> kFamilies = {
    "robot-like",   "nothing-hidden", "clean-free-load", "one-direction", "joint-side",
    "elastic-load", "few-records",    "torque-sensor",   "by-direction",  "second-structure"};

enum class Units { motor, scaled_joint, joint };  // scaled: the joint's angle times the ratio, as logs of arms are read

struct HiddenEffect {
  std::string effect;
  int order = 0;                      // 0: the effect has none
  std::vector<std::string> accepted;  // names that cannot be distinguished from it, its own first
  double wanted_share = 0.0;          // of the squared error of the base model, without noise
  double share = 0.0;                 // as it came out
  double share_behind_presliding = 0.0;
  double size = 0.0;
};

struct Sensors {
  double sample_hz = 200.0;
  double jitter = 0.0;  // of the sample time
  bool stamps_are_true = true;
  double effort_noise = 0.02;  // of the effort's RMS
  bool coloured = false;
  double effort_bits = 12.0;  // of twice the peak
  int encoder_bits = 14;      // per turn of the shaft that it is on
  double velocity_lag_s = 0.0;
  bool velocity_column = false;
  bool torque_column = false;
  double torque_noise = 0.01;  // of the torque's RMS
  double torque_gain = 1.0;
  bool temperature_column = false;
  double effort_lag_samples = 0.0;  // the effort's time base against the position's
  double current_offset = 0.0;      // A, what the sensor reads at zero current
};

struct Record {
  std::string name;
  Trajectory trajectory;
  RecordConditions conditions;
};

struct Twin {
  std::uint64_t seed = 0;
  std::string family;
  Joint joint;
  Controller controller;
  Units units = Units::motor;
  Sensors sensors;
  MotionKind motion = MotionKind::multisine;
  bool same_trajectory = false;
  double friction_difference = 0.0;  // between records and directions
  bool offset_in_base = false, gravity_in_base = false;
  double second_share_wanted = 0.0;
  std::vector<HiddenEffect> hidden;
  std::vector<Record> fit;
  Record holdout;
};

Twin draw(std::uint64_t seed, std::string_view family);

// Sets the parameter behind a hidden effect: 0 takes it out.
void set_size(Twin& twin, const HiddenEffect& effect, double size);
// The most that is plausible.
double largest_size(const Twin& twin, const HiddenEffect& effect);

}  // namespace flexspline::worlds
