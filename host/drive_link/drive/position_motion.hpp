// A run of a plan in mode `position`: the set points that a host sends while the drive's own trajectory, with its
// limits of velocity and acceleration, goes from one to the next.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/drive_link/drive/scales.hpp"
#include "host/engine/planning/plan.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::drive {

// Set points of a run are radians of the motor from the shaft's position when it begins. A host's messages are not
// punctual and a trajectory comes to rest where nothing follows, so each message asks for a place further on than the
// next one will come late, at the run's velocity, corrected by how far the drive's set point is from the run's.
class PositionMotion {
 public:
  static constexpr double kAhead_s = 0.2;
  static constexpr double kCatchUp_s = 0.05;

  // Throws PlanError where the run does not keep to the plan's limits of velocity (a square has none) and travel.
  PositionMotion(const planning::Run& run, const planning::Limits& limits, const Scales& scales);

  // Position of the shaft, 2^-32 turns.
  void start_at(std::int64_t angle) { start_ = angle; }
  protocol::Command arm(bool compensate) const;
  // `time_s` since the run began, `set_point_rad` the drive's own at that time, from the start.
  protocol::Command at(double time_s, double set_point_rad) const;
  double wanted_rad(double time_s) const;

 private:
  const Scales& scales_;
  std::vector<double> points_;
  double velocity_limit_ = 0.0;  // rad/s; zero: the drive's
  std::int64_t start_ = 0;
};

}  // namespace flexspline::drive
