// Presliding friction of several laws, written for these worlds alone: all advance by increments of the angle.
#pragma once

#include <string_view>
#include <vector>

namespace flexspline::worlds {

enum class PreslidingLaw { dahl, lugre, elastoplastic, maxwell_slip, set_valued_and_bristles };

std::string_view name_of(PreslidingLaw law);

// The friction torque behind a reversal. `level` is the torque of steady sliding at this speed and load.
class Presliding {
 public:
  // `length`: the angle over which friction turns round, in rad of the motor.
  Presliding(PreslidingLaw law, double length);

  // The angle moves by `step`. `stretch` makes the length longer (presliding that grows with load).
  void advance(double step, double level, double stretch);

  // Torque of the bristles at this level; opposes positive motion where positive.
  double torque(double level) const;
  // Torque of the part with no presliding at all: to be solved as a set-valued sign.
  double set_valued(double level) const { return set_valued_share_ * level; }
  // From -1 to 1: how far the bristles are loaded.
  double load() const;
  // Stiffness per level, 1/rad: for a damping that fits.
  double stiffness() const { return 1.0 / length_; }

 private:
  PreslidingLaw law_;
  double length_;
  double set_valued_share_ = 0.0;
  double level_ = 0.0;                            // of the last step, for the law whose state is a torque
  std::vector<double> lengths_, shares_, loads_;  // of the elements
};

// The velocity after a step with a set-valued friction: `free` is the one without it, `stop` what friction can take
// away.
double after_set_valued_friction(double free, double stop);

}  // namespace flexspline::worlds
