// Motions that lead a model through its whole envelope: what a block is compared with double on.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/effects/effect.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::deployment {

// Signals as a drive has them after its inputs were limited. Segments of some hundred ticks in which each signal
// swings through its range, slowly or fast, or is at a corner: at an end, at zero, or one unit away from it.
class Samples {
 public:
  Samples(const effects::DriveConstants<double>& drive, std::uint64_t seed);
  effects::Inputs<fixed::Fixed> next();

 private:
  enum Channel { velocity, torsion, acceleration, output_velocity, output_acceleration, torque, current, temperature };
  static constexpr int kChannels = temperature + 1;
  struct Swing {
    double phase = 0.0;
    double rate = 0.0;
    std::int32_t corner = 0;
    bool at_corner = false;
  };
  double between(double low, double high);
  void start();
  std::int32_t step(int channel);

  effects::DriveConstants<double> drive_;
  std::mt19937_64 random_;
  std::array<Swing, kChannels> swings_;
  double angle_turns_ = 0.0;
  std::int32_t torsion_ = 0;
  int left_ = 0;
};

// The same signals in double, to the last bit; angles in the unit of the motor's position.
effects::Inputs<numbers::Real> in_double(const effects::Inputs<fixed::Fixed>& in,
                                         const effects::DriveConstants<double>& drive);

}  // namespace flexspline::deployment
