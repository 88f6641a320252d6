// A three-phase motor in integers, so that the control of a power stage runs in closed loop with the same bits on every
// machine. Rough, but it turns: R, L in both axes, back-EMF, inertia, friction, noise of the sensors.
#pragma once

#include "shared/control/commissioning/output.hpp"
#include "shared/control/foc/transforms.hpp"
#include "tests/same_bits/adversarial.hpp"

namespace flexspline::same_bits {

namespace foc = control::foc;

// Per unit of 40 A and 60 V at 40 kHz: that of tests/counts/current_loop_example.hpp, 0.304 ohm, 0.3 mH, 6 mVs.
class IntegerMotor {
 public:
  static constexpr std::int32_t kTimerCounts = 2100, kPolePairs = 4, kBus = 26'214;

  // One PWM period with these on-times; not enabled: no current flows.
  void step(const foc::Phases& counts, bool enabled) {
    const foc::Rotation at = foc::rotation(electrical());
    if (enabled) {
      const auto leg = [&](std::int32_t count) {
        return std::int64_t{count} * (std::int64_t{bus} << 13) / kTimerCounts;
      };
      const std::int64_t a = leg(counts.a), b = leg(counts.b), c = leg(counts.c);
      const foc::RotorVector v = control::commissioning::in_axes(
          {static_cast<std::int32_t>((2 * a - b - c) / 3), static_cast<std::int32_t>(((b - c) * kPerRoot3) >> 16)}, at);
      d_ = held(d_ + (((v.d / 2 - ((d_ * kOhm) >> 16)) * kPerHenry) >> 16));
      q_ = held(q_ + (((v.q / 2 - ((q_ * kOhm) >> 16) - ((speed_ * kFlux) >> 7)) * kPerHenry) >> 16));
    } else {
      d_ = q_ = 0;
    }
    turn();
  }
  foc::Phases readings(Random& random) const {
    const foc::Phases i = foc::inverse_clarke(control::commissioning::in_stator(
        {static_cast<std::int32_t>(d_), static_cast<std::int32_t>(q_)}, foc::rotation(electrical())));
    const std::uint64_t noise = random.next();
    const auto seen = [&](std::int32_t current, int shift) {
      const auto off = static_cast<std::int32_t>((noise >> shift) & 15) + shift - 20;
      return fixed::limited<std::int32_t>((current >> 12) + off, INT16_MIN, INT16_MAX);
    };
    return {seen(i.a, 8), has_sensor_b ? seen(i.b, 16) : 0, seen(i.c, 24)};
  }
  // Of the rotor, 2^-32 turns, whole turns included.
  std::int64_t angle() const { return angle_ / kPolePairs; }

  std::int32_t bus = kBus;  // 2^-15
  bool has_sensor_b = true;

 private:
  static constexpr std::int64_t kPerRoot3 = 37'837, kOhm = 13'282, kPerHenry = 8'192, kFlux = 100, kFriction = 900;

  static std::int64_t held(std::int64_t current) {
    constexpr std::int64_t kMost = std::int64_t{1} << 27;
    return fixed::limited<std::int64_t>(current, -kMost, kMost);
  }
  std::uint32_t electrical() const { return static_cast<std::uint32_t>(angle_); }
  void turn() {
    const std::int64_t driven = speed_ + (q_ >> 13) - (speed_ >> 14);
    if (driven > kFriction)
      speed_ = driven - kFriction;
    else
      speed_ = driven < -kFriction ? driven + kFriction : 0;
    angle_ += speed_;
  }

  std::int64_t d_ = 0, q_ = 0;  // 2^-27
  std::int64_t speed_ = 0;      // electrical, 2^-32 turns a period
  std::int64_t angle_ = 0;      // electrical
};

}  // namespace flexspline::same_bits
