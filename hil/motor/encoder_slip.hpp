#pragma once

#include <cmath>

namespace flexspline::motor {

/// An encoder that slips on its shaft, by the same angle each time that the shaft has turned by another one.
class EncoderSlip {
 public:
  /// The turns of the encoder at these of the shaft. `every_turns` zero: it does not slip.
  double encoder_turns(double shaft_turns, double every_turns, double slip_turns) {
    if (!began_) from_turns_ = first_turns_ = shaft_turns;
    began_ = true;
    if (every_turns > 0.0 && std::abs(shaft_turns - from_turns_) >= every_turns) {
      slipped_turns_ += std::copysign(slip_turns, shaft_turns - from_turns_);
      from_turns_ = shaft_turns;
    }
    return shaft_turns - slipped_turns_;
  }
  /// Of the shaft, at the first call.
  double first_turns() const { return first_turns_; }

 private:
  bool began_ = false;
  double first_turns_ = 0.0;
  double from_turns_ = 0.0;  // where it slipped last
  double slipped_turns_ = 0.0;
};

}  // namespace flexspline::motor
