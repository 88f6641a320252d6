#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "tests/worlds/drives/case.hpp"

namespace flexspline::worlds::drives {

struct Range {
  double low, high;
};

/// Ranges of one kind of drive; the numbers are those of the motor's side unless their name says otherwise.
struct Kind {
  std::string_view name;
  Range gear_ratio;
  Range motor_inertia_kgm2;
  Range inertia_ratio;     // of the load, at the motor, to the motor's
  Range antiresonance_hz;  // with the motor held; 0: coupled rigidly
  Range torque_constant_nm_a;
  Range rated_current_a;
  Range coulomb_share;  // of the rated torque
  Range viscous_share;  // of the rated torque, at rated velocity
  Range rated_velocity_rad_s;
  Range used_velocity;  // share of it that motions reach
  Range range_turns;    // of the output
  Range band_hz;        // of what repeats
  Range record_s;
  std::vector<double> rates_hz;
  std::vector<double> motor_counts;
  double presliding_chance;
  Range presliding_rad;
  std::vector<std::string_view> motions;
  std::vector<std::string_view> hidden;
};

/// The eight kinds (kinds.cpp, with the sources of the ranges).
const std::vector<Kind>& kinds();

/// A machine of this kind, with what it hides and its motions. `attempt` counts the machines drawn before with this
/// seed. Half of the seeds hide nothing.
Case draw(const Kind& kind, std::uint64_t seed, int attempt);

/// Hides an effect of this name in a drawn case, of a size that such a drive has.
void hide(Case& drive, const Kind& kind, std::string_view effect, Random& random);

}  // namespace flexspline::worlds::drives
