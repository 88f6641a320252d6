// Motions of a joint as its controller is asked for them, with exact derivatives. Angles are those of the output.
#pragma once

#include <numbers>
#include <string_view>
#include <vector>

#include "tests/worlds/random.hpp"

namespace flexspline::worlds {

inline constexpr double kTurn = 2.0 * std::numbers::pi;  // rad

struct Reference {
  double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

enum class MotionKind { multisine, trapezoids, slow_sweep, one_direction };

std::string_view name_of(MotionKind kind);

class Trajectory {
 public:
  // `direction` counts for motions of one direction. Lasts `duration_s`; before and after, the ends hold.
  static Trajectory draw(MotionKind kind, double duration_s, double peak_velocity, double direction, Random& random);

  Reference at(double time_s) const;
  double duration_s() const { return duration_s_; }

 private:
  struct Sine {
    double amplitude, frequency, phase;
  };
  // A stretch of constant jerk-free acceleration.
  struct Stretch {
    double from_s;
    Reference start;
  };
  void begin(double position);
  void accelerate(double acceleration, double duration_s);
  void go_to(double velocity, double acceleration);
  void move(double distance, double velocity, double acceleration);

  double duration_s_ = 0.0;
  std::vector<Sine> sines_;
  std::vector<Stretch> stretches_;
  double end_s_ = 0.0;
};

}  // namespace flexspline::worlds
