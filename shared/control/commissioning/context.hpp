// What the steps of commissioning share: settings, what was found so far, the sample of this period; and a slow current
// loop, whose gains follow from the first numbers.
#pragma once

#include <cstdint>

#include "shared/control/commissioning/estimators.hpp"
#include "shared/control/commissioning/output.hpp"
#include "shared/control/commissioning/settings.hpp"

namespace flexspline::control::commissioning {

struct Context {
  Settings settings;
  Result result;
  foc::SensorSettings sensors;  // with what was found of them
  Sample now;

  // What the legs lose at these currents: around zero in proportion, as noise would decide the sign.
  constexpr foc::StatorVector lost(const foc::Phases& currents) const {
    constexpr int kZoneBits = 6, kShareBits = 12;  // a zone of a sixty-fourth of the test current
    const std::int32_t zone = settings.current >> kZoneBits, per_share = result.lost_voltage / (zone >> kShareBits);
    const auto loss = [&](std::int32_t i) { return (fixed::limited(i, -zone, zone) >> kShareBits) * per_share; };
    return foc::clarke({loss(currents.a), loss(currents.b), loss(currents.c)});
  }
  // What the motor has of the voltage.
  constexpr foc::StatorVector motor_voltage() const {
    const foc::StatorVector x = lost(now.phases);
    return {now.voltage.alpha - x.alpha, now.voltage.beta - x.beta};
  }
  constexpr void fail(Fault fault, int phase = 0) {
    if (result.fault != Fault::none) return;
    result.fault = fault;
    result.phase = static_cast<std::uint8_t>(phase);
  }
};

constexpr std::int32_t size(std::int32_t x) {
  return x < 0 ? -x : x;
}
constexpr std::int32_t largest_size(const foc::Phases& x) {
  const std::int32_t a = size(x.a), b = size(x.b), c = size(x.c), ab = a > b ? a : b;
  return ab > c ? ab : c;
}
constexpr std::int32_t smallest_size(const foc::Phases& x) {
  const std::int32_t a = size(x.a), b = size(x.b), c = size(x.c), ab = a < b ? a : b;
  return ab < c ? ab : c;
}
// 1 to 3: the phase of that size.
constexpr int phase_of_size(const foc::Phases& x, std::int32_t wanted) {
  return size(x.a) == wanted ? 1 : size(x.b) == wanted ? 2 : 3;
}
constexpr int largest_phase(const foc::Phases& x) {
  return phase_of_size(x, largest_size(x));
}
constexpr int smallest_phase(const foc::Phases& x) {
  return phase_of_size(x, smallest_size(x));
}
// 0 to 2: the angle of a phase.
constexpr std::uint32_t angle_of_phase(int phase) {
  return static_cast<std::uint32_t>(phase) * 1431655765U;
}

// Proportional and integral, in a frame that turns with the set point: V = w T (L e + R sum e) with w T = 1/16.
class SlowCurrentLoop {
 public:
  constexpr void begin(std::int32_t resistance, std::int32_t inductance, const foc::RotorVector& voltage) {
    resistance_ = resistance;
    inductance_ = inductance;
    sum_ = {};
    sum_.d = std::int64_t{voltage.d} << kSumBits;
    sum_.q = std::int64_t{voltage.q} << kSumBits;
  }
  // The same currents by voltages that are now at another angle.
  constexpr foc::RotorVector update(const foc::RotorVector& wanted, const foc::RotorVector& measured,
                                    std::int32_t most) {
    return {axis(sum_.d, wanted.d - measured.d, most), axis(sum_.q, wanted.q - measured.q, most)};
  }

 private:
  static constexpr int kSumBits = 16;
  static constexpr int kSixteenth = 4;
  static constexpr int kToVoltage = kSharesBits + 27 - 28 + kSixteenth;  // of a share times a current
  constexpr std::int32_t axis(std::int64_t& sum, std::int32_t error, std::int32_t most) const {
    const std::int64_t limit = std::int64_t{most} << kSumBits;
    const std::int64_t added = std::int64_t{resistance_} * error, direct = std::int64_t{inductance_} * error;
    sum = fixed::limited_to(sum + fixed::shift_right(added, kToVoltage - kSumBits), limit);
    const std::int64_t voltage = fixed::shift_right(sum, kSumBits) + fixed::shift_right(direct, kToVoltage);
    return static_cast<std::int32_t>(fixed::limited_to(voltage, std::int64_t{most}));
  }

  std::int32_t resistance_ = 0;
  std::int32_t inductance_ = 0;
  VectorSum sum_;
};

// A vector of current that turns, its step led to a target by a ramp.
class TurningVector {
 public:
  constexpr void place(std::uint32_t angle) { angle_ = angle; }
  constexpr void advance(std::int32_t target, std::int32_t ramp) {
    const std::int32_t change = fixed::limited(target - step_, -ramp, ramp);
    step_ += change;
    angle_ += static_cast<std::uint32_t>(step_);
    turned_ += step_;
  }
  constexpr std::uint32_t angle() const { return angle_; }
  constexpr std::int32_t step() const { return step_; }
  constexpr std::int64_t turned() const { return turned_; }  // 2^-32 turns

 private:
  std::uint32_t angle_ = 0;
  std::int32_t step_ = 0;
  std::int64_t turned_ = 0;
};

inline constexpr std::int64_t kTurn = std::int64_t{1} << 32;

}  // namespace flexspline::control::commissioning
