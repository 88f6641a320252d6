// A voltage of an eighth of the PWM rate along one axis, on a rotor that stands: the inductance of that axis.
#pragma once

#include <cstdint>

#include "shared/control/commissioning/context.hpp"

namespace flexspline::control::commissioning {

class Injection {
 public:
  constexpr void begin() { *this = {}; }
  constexpr bool done() const { return impedance_.done(); }
  constexpr bool measures() const { return part_ == Part::measure; }
  constexpr std::int32_t inductance(std::int32_t resistance) const { return impedance_.inductance(resistance); }

  // Voltage and current of this sample along the axis; returns what to add to the voltage of the next period. The
  // amplitude grows until the current's ripple is a quarter of the test current, or to the limit of the voltage.
  constexpr std::int32_t update(const Settings& s, std::int32_t voltage, std::int32_t current) {
    const std::int32_t before = phase_;
    phase_ = (phase_ + 1) & 7;
    if (part_ == Part::still) {
      level_ += current;
      if (++count_ == (1 << kStillBits)) {
        level_ >>= kStillBits;
        go(Part::grow);
      }
      return 0;
    }
    if (part_ == Part::grow) {
      if (size(current - static_cast<std::int32_t>(level_)) >= s.current / 4 || amplitude_ >= s.most_voltage) {
        go(Part::transient);
      } else {
        amplitude_ += s.most_voltage >> 11;
      }
    } else if (part_ == Part::transient) {
      if (++count_ >= kTransientPeriods && before == 0) part_ = Part::measure;
    }
    if (part_ == Part::measure && !impedance_.done()) {
      impedance_.add(voltage, current);
      // Slowly down by a quarter, so that readings do not repeat: else the converter's steps would not average out.
      amplitude_ -= amplitude_ >> (Impedance::kSamplesBits + 2);
    }
    const auto angle = static_cast<std::uint32_t>(phase_) * Impedance::kTurnsPerPeriod;
    return fixed::multiply_high(amplitude_, foc::rotation(angle).cosine) * 4;
  }

 private:
  enum class Part : std::uint8_t { still, grow, transient, measure };
  static constexpr int kStillBits = 6;
  static constexpr int kTransientPeriods = 256;
  constexpr void go(Part part) {
    part_ = part;
    count_ = 0;
  }

  Part part_ = Part::still;
  std::int32_t phase_ = 0;
  std::int32_t count_ = 0;
  std::int32_t amplitude_ = 0;
  std::int64_t level_ = 0;
  Impedance impedance_;
};

}  // namespace flexspline::control::commissioning
