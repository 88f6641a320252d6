#pragma once

#include <string>
#include <vector>

namespace flexspline::board {

/// Set point of the output: rad, rad/s, rad/s^2.
struct Reference {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// A motion of the output from rest at zero. `kind` determines which members are used.
struct Motion {
  enum class Kind {
    sines,      ///< their sum, faded in during the first second by 3 x^2 - 2 x^3
    constant,   ///< `velocity_rad_s`, reached within half a second
    trapezoid,  ///< back and forth with `acceleration_rad_s2`: an eighth of the period each faster and slower, between
                ///< them a quarter at speed
    waypoints,  ///< from point to point, at rest in each, with the least jerk: a polynomial of degree five between them
  };
  struct Sine {
    double amplitude_rad = 0.0;
    double frequency_hz = 0.0;
    double ahead_s = 0.0;
  };
  struct Waypoint {
    double time_s = 0.0;
    double position_rad = 0.0;
  };
  Kind kind = Kind::sines;
  std::vector<Sine> sines{};
  double velocity_rad_s = 0.0;
  double acceleration_rad_s2 = 0.0;
  double period_s = 0.0;
  std::vector<Waypoint> waypoints{};  ///< times rise, the first above zero

  Reference at(double time_s) const;
};

}  // namespace flexspline::board
