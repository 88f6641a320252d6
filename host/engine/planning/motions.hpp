// The motions that a plan is chosen from.
#pragma once

#include <string>
#include <vector>

#include "host/engine/planning/plan.hpp"

namespace flexspline::planning {

// The limits of the drive, and what the person at the drive is willing to do.
struct MotionSettings {
  Limits limits;
  double gear_ratio = 1.0;
  double locked_current_a = 0.0;  // that the gear carries with its output locked
  double run_s = 8.0;
  bool off = true;
  bool free = true;  // the output can move
  bool locked = true;
  bool external_load = true;
  bool temperature = true;
  double cold_c = 25.0;
  double warm_c = 40.0;
};

// Runs that make sense together only: a ladder of speeds, two directions of a load, two temperatures.
struct Motion {
  std::string name;
  std::vector<Run> runs;
  double operator_effort =
      0.0;  // the effort for a person: 0 nothing, 1 a lock or a switch, 2 a weight, 3 waiting for heat
};

// Amplitudes are as large as the limits let them be, or a stated part of that. Deterministic.
std::vector<Motion> motions(const MotionSettings& setting);

}  // namespace flexspline::planning
