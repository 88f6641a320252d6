#pragma once

#include <cstdint>

#include "hil/motor/encoder_slip.hpp"
#include "hil/motor/motor.hpp"
#include "hil/motor/parameters.hpp"

namespace flexspline::motor {

/// A rigid rotor with Coulomb and viscous friction, one PWM period at a time.
class Shaft {
 public:
  Shaft(const ShaftParameters& parameters, int pole_pairs) : p_(parameters), pole_pairs_(pole_pairs) {}

  void step(double torque_nm, double dt);
  void set_turns(double turns);
  double turns() const;
  double speed_rad_s() const { return speed_; }
  Rotor electrical() const { return {angle_ * pole_pairs_, speed_ * pole_pairs_}; }

 private:
  ShaftParameters p_;
  int pole_pairs_;
  double angle_ = 0.0;  // rad
  double speed_ = 0.0;
};

/// What an encoder shows of it.
class ShaftEncoder {
 public:
  explicit ShaftEncoder(const EncoderParameters& parameters) : p_(parameters) {}
  /// 2^-32 turns, in steps of its counts.
  std::uint32_t read(double shaft_turns);

 private:
  EncoderParameters p_;
  EncoderSlip slip_;
};

}  // namespace flexspline::motor
