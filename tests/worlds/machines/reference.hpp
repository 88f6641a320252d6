// The motions that the controllers of these machines are asked for.
#pragma once

#include <array>
#include <string_view>

#include "tests/worlds/machines/signal.hpp"

namespace flexspline::worlds::machines {

enum class Motion { sweep, trapezoids, point_to_point, fourier };

inline constexpr std::array<Motion, 4> kMotions = {Motion::sweep, Motion::trapezoids, Motion::point_to_point,
                                                   Motion::fourier};

std::string_view name_of(Motion motion);

// The most that a motion reaches.
struct MotionLimits {
  double velocity_rad_s = 1.0, acceleration_rad_s2 = 1.0, range_rad = 1.0;
};

// Per tick of the controller.
struct Reference {
  Signal angle_rad, velocity_rad_s, acceleration_rad_s2;
};

Reference draw_reference(Motion motion, double duration_s, const MotionLimits& limits, Dice& dice);

}  // namespace flexspline::worlds::machines
