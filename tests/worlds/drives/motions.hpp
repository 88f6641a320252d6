#pragma once

#include <string>
#include <vector>

#include "tests/worlds/drives/random.hpp"

namespace flexspline::worlds::drives {

/// What a motion may use, at the motor's shaft.
struct MotionLimits {
  double velocity_rad_s = 0.0;
  double acceleration_rad_s2 = 0.0;
  double range_rad = 0.0;  // from the lowest to the highest angle
};

/// Angles of the motor in rad, one a period.
struct Motion {
  std::string name;
  double period_s = 0.0;
  std::vector<double> position_rad;
};

struct MotionRequest {
  std::string name;  // one of those that make_motion knows
  double duration_s = 0.0;
  double period_s = 0.0;
  double low_hz = 0.0;  // band of what repeats
  double high_hz = 0.0;
  MotionLimits limits;
};

/// A motion from rest, within the limits. Names: point_to_point, minimum_jerk, sine, chirp, multisine, walking,
/// tracking, raster, speed_steps, drive_cycle, wander.
Motion make_motion(const MotionRequest& request, Random& random);

}  // namespace flexspline::worlds::drives
