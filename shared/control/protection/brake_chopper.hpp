// A brake resistor on the bus, for the energy that a motor gives back and its supply does not take. Its duty is
// proportional to the bus voltage above a first one:
//   duty = clamp((bus - begin) slope, 0, most)
//   heat <- heat - heat T/tau + duty bus^2           in periods of the power at full scale of the bus voltage
// tau is the resistor's energy over its continuous power: with that power for ever, heat ends at the energy. At that
// energy the resistor goes off until half of it has gone; what the motor gives back then raises the bus until the
// stage's limit of the bus voltage opens all switches.
#pragma once

#include <cstdint>

namespace flexspline::control::protection {

struct ChopperSettings {
  std::int32_t begin = INT16_MAX;  // bus voltage, 2^-15 of its full scale
  std::uint32_t slope = 0;         // share of the period for full scale of the bus voltage, 2^-8; below 2^16
  std::int32_t most_duty = 0;      // 2^-15
  std::int64_t most_heat = 0;      // 2^-30; below 2^60
  std::uint32_t cooling = 0;       // T/tau, 2^-32
};

class BrakeChopper {
 public:
  // Once a PWM period. `bus` is from zero to 2^15 - 1. Returns the resistor's share of the period, 2^-15.
  constexpr std::int32_t update(const ChopperSettings& s, std::int32_t bus) {
    heat_ -= static_cast<std::int64_t>(((static_cast<std::uint64_t>(heat_) >> kCoolingBits) * s.cooling) >>
                                       (32 - kCoolingBits));
    if (heat_ >= s.most_heat) is_limited_ = true;
    if (heat_ < s.most_heat / 2) is_limited_ = false;
    if (bus <= s.begin || is_limited_) return 0;
    const auto wanted = static_cast<std::int32_t>((static_cast<std::uint32_t>(bus - s.begin) * s.slope) >> 8);
    const std::int32_t duty = wanted < s.most_duty ? wanted : s.most_duty;
    heat_ += (std::int64_t{duty} * (bus * bus)) >> 15;
    return duty;
  }
  // It has taken all the energy that it can.
  constexpr bool is_limited() const { return is_limited_; }
  constexpr std::int64_t heat() const { return heat_; }

 private:
  static constexpr int kCoolingBits = 20;
  std::int64_t heat_ = 0;
  bool is_limited_ = false;
};

}  // namespace flexspline::control::protection
