// Readings of the current sensors to phase currents, and the calibration of their zero.
#pragma once

#include <cstdint>

#include "shared/control/foc/transforms.hpp"

namespace flexspline::control::foc {

// A reading is a share of full scale, 2^-15; a current is in 2^-27 of its base: reading gain - offset.
struct SensorSettings {
  Phases gain;       // 4096 where full scale is the base and the sensor is exact; below 2^13
  Phases offset;     // 2^-27 of the base
  bool two = false;  // phase c has no sensor
};

// The phase `unmeasured` (modulation.hpp) is what the other two leave, as phase c always is where it has no sensor.
constexpr Phases phase_currents(const SensorSettings& s, const Phases& reading, std::int32_t unmeasured) {
  Phases i = {reading.a * s.gain.a - s.offset.a, reading.b * s.gain.b - s.offset.b, reading.c * s.gain.c - s.offset.c};
  if (s.two || unmeasured == 3) {
    i.c = -i.a - i.b;
  } else if (unmeasured == 1) {
    i.a = -i.b - i.c;
  } else if (unmeasured == 2) {
    i.b = -i.a - i.c;
  }
  return i;
}

enum class OffsetFault : std::uint8_t { none, offset_too_large, current_flows };
// The mean of 1024 readings of each phase, taken while no current can flow: all low sides on, or all switches open
// where the sensors see the phases. Refused where a mean is further from zero than a sensor's error can be, or where
// readings differ by more than their noise does: then a current flows, or a rotor turns.
class OffsetCalibration {
 public:
  static constexpr int kSamplesBits = 10;
  struct Limits {
    std::int32_t offset = 0;  // of a mean, 2^-15
    std::int32_t spread = 0;  // largest less smallest reading
  };
  struct Result {
    Phases offset;  // for the gains of `settings`
    OffsetFault fault = OffsetFault::none;
    std::uint8_t phase = 0;  // 1 to 3, of the fault
  };

  constexpr void add(const Phases& reading) {
    if (done()) return;
    take(a_, reading.a);
    take(b_, reading.b);
    take(c_, reading.c);
    ++count_;
  }
  constexpr bool done() const { return count_ == (1 << kSamplesBits); }
  // Once it is done.
  constexpr Result result(const SensorSettings& settings, const Limits& limits) const {
    Result r;
    r.offset = {mean(a_, settings.gain.a), mean(b_, settings.gain.b), settings.two ? 0 : mean(c_, settings.gain.c)};
    const Seen* seen[] = {&a_, &b_, &c_};
    for (int phase = 0; phase < (settings.two ? 2 : 3) && r.fault == OffsetFault::none; ++phase) {
      const Seen& s = *seen[phase];
      const std::int32_t all = limits.offset << kSamplesBits;
      if (s.most - s.least > limits.spread) r.fault = OffsetFault::current_flows;
      if (s.sum > all || s.sum < -all) r.fault = OffsetFault::offset_too_large;
      if (r.fault != OffsetFault::none) r.phase = static_cast<std::uint8_t>(phase + 1);
    }
    return r;
  }

 private:
  struct Seen {
    std::int32_t sum = 0;
    std::int32_t least = 32767;
    std::int32_t most = -32768;
  };
  static constexpr void take(Seen& s, std::int32_t reading) {
    s.sum += reading;
    if (reading < s.least) s.least = reading;
    if (reading > s.most) s.most = reading;
  }
  static constexpr std::int32_t mean(const Seen& s, std::int32_t gain) {
    constexpr std::int64_t kHalf = std::int64_t{1} << (kSamplesBits - 1);
    return static_cast<std::int32_t>((std::int64_t{s.sum} * gain + kHalf) >> kSamplesBits);
  }

  Seen a_, b_, c_;
  std::int32_t count_ = 0;
};

}  // namespace flexspline::control::foc
