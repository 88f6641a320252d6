// Direct currents at two levels along each phase: the resistance from their differences, in which dead time and drops
// cancel; the current sensors' gains; and the faults of the wiring, by which currents flow where.
#pragma once

#include <cstdint>

#include "shared/control/commissioning/context.hpp"

namespace flexspline::control::commissioning {

class ResistanceTest {
 public:
  constexpr bool done() const { return direction_ == kDirections; }

  constexpr foc::StatorVector update(Context& c) {
    // The high one first: it brings the rotor to where it stays at the low one.
    const std::int32_t target = level_ == 0 ? c.settings.current : c.settings.current / 2;
    switch (part_) {
      case Part::rest:
        voltage_ = 0;
        if (++count_ >= kRestPeriods) go(Part::ramp);
        break;
      case Part::ramp:
        ramp(c, target);
        break;
      case Part::transient:
        wait_for_transient(c, target);
        break;
      case Part::average:
        average(c, target);
        break;
    }
    if (done()) return {};
    return in_stator({voltage_, 0}, foc::rotation(angle_of_phase(direction_)));
  }
  // Once it is done: resistance, gains, lost voltage; or a fault.
  constexpr void conclude(Context& c) const {
    const int silent = silent_[0] + silent_[1] + silent_[2];
    if (silent > 1) return c.fail(Fault::not_connected);
    if (silent == 1) return c.fail(Fault::phase_open, silent_[0] != 0 ? 1 : silent_[1] != 0 ? 2 : 3);
    if (is_weak(c)) return;
    for (int k = 0; k < kDirections; ++k) {
      const PhaseMeans& m = high_[k].phases;
      if (2 * of_phase(m, k) < c.settings.current) return c.fail(Fault::sensor_order, k + 1);
    }
    foc::Phases by = {kOne, kOne, kOne};
    if (!c.sensors.two) by = gain_corrections(high_[0].phases, high_[1].phases, high_[2].phases);
    if (!plausible(by)) return c.fail(Fault::gains_differ);
    std::int32_t resistance[kDirections]{};
    std::int64_t lost = 0;
    for (int k = 0; k < kDirections; ++k) {
      const std::int64_t low_i = along(by, low_[k].phases, k), high_i = along(by, high_[k].phases, k);
      // Voltages in 2^-28, currents in 2^-27.
      resistance[k] = ratio(high_[k].voltage - low_[k].voltage, high_i - low_i, kSharesBits - 1);
      lost += high_[k].voltage - ((std::int64_t{resistance[k]} * high_i) >> (kSharesBits - 1));
    }
    if (differ(c, resistance)) return;
    correct(c.sensors, by);
    c.result.gain = c.sensors.gain;
    c.result.offset = c.sensors.offset;
    c.result.resistance = resistance[0] / 3 + resistance[1] / 3 + resistance[2] / 3;
    // Along a phase, two thirds of a leg's loss out and of one back: 4/3 of it.
    c.result.lost_voltage = static_cast<std::int32_t>(lost >> 2);
  }

 private:
  enum class Part : std::uint8_t { rest, ramp, transient, average };
  struct Level {
    PhaseMeans phases;
    std::int64_t voltage = 0;
  };
  static constexpr std::int32_t kOne = 4096;  // of gains and corrections
  static constexpr int kDirections = 3;
  static constexpr int kRestPeriods = 512;
  static constexpr int kTransientPeriods = 1024;
  static constexpr int kSamplesBits = 10;
  static constexpr std::int32_t kMostWindows = 32;  // until the rotor stands

  constexpr void go(Part part) {
    part_ = part;
    before_ = 0;
    again();
  }
  constexpr void again() {
    count_ = 0;
    sum_ = {};
  }
  // By the largest phase, whichever it is: sensors may be in another order than the legs.
  constexpr void ramp(Context& c, std::int32_t target) {
    const std::int32_t most = largest_size(c.now.phases);
    if (most >= target) return go(Part::transient);
    if (voltage_ < c.settings.most_voltage) {
      voltage_ += c.settings.voltage_ramp;
      return;
    }
    if (most < c.settings.current / 8) {
      silent_[direction_] = 1;
    } else if (8 * smallest_size(c.now.phases) < most) {
      return c.fail(Fault::phase_open, smallest_phase(c.now.phases));
    } else {
      weak_[direction_] = ratio(voltage_, most, kSharesBits - 1);
    }
    next_direction();
  }
  // What a moving rotor induced, and the ramp added for it, goes down again.
  constexpr void wait_for_transient(const Context& c, std::int32_t target) {
    if (largest_size(c.now.phases) > target + target / 8 && voltage_ > 0) {
      voltage_ -= c.settings.voltage_ramp;
      count_ = 0;
    }
    if (++count_ >= kTransientPeriods) go(Part::average);
  }
  constexpr void average(const Context& c, std::int32_t target) {
    const foc::Rotation r = foc::rotation(angle_of_phase(direction_));
    sum_.phases.a += c.now.phases.a;
    sum_.phases.b += c.now.phases.b;
    sum_.phases.c += c.now.phases.c;
    sum_.voltage += in_axes(c.now.voltage, r).d;
    if (++count_ < (1 << kSamplesBits)) return;
    const auto mean = [](std::int64_t x) { return x >> kSamplesBits; };
    const Level level = {{mean(sum_.phases.a), mean(sum_.phases.b), mean(sum_.phases.c)}, mean(sum_.voltage)};
    const foc::Phases means = {static_cast<std::int32_t>(level.phases.a), static_cast<std::int32_t>(level.phases.b),
                               static_cast<std::int32_t>(level.phases.c)};
    // A current of the rotor's motion ended the ramp too early, or the rotor still moves.
    const std::int32_t most = largest_size(means), change = size(most - before_);
    before_ = most;
    const bool more = ++windows_ < kMostWindows;
    if (more && change > target / 128) return again();
    if (more && most < target - target / 8 && voltage_ < c.settings.most_voltage) return go(Part::ramp);
    windows_ = 0;
    (level_ == 0 ? high_ : low_)[direction_] = level;
    if (level_ == 0) {
      level_ = 1;
      return go(Part::ramp);
    }
    next_direction();
  }
  constexpr void next_direction() {
    level_ = 0;
    ++direction_;
    go(Part::rest);
  }

  static constexpr std::int64_t of_phase(const PhaseMeans& m, int k) { return k == 0 ? m.a : k == 1 ? m.b : m.c; }
  static constexpr foc::Phases corrected(const PhaseMeans& m, const foc::Phases& by) {
    const auto x = [](std::int64_t mean, std::int32_t factor) {
      return static_cast<std::int32_t>((mean * factor) >> 12);
    };
    return {x(m.a, by.a), x(m.b, by.b), x(m.c, by.c)};
  }
  static constexpr std::int64_t along(const foc::Phases& by, const PhaseMeans& m, int k) {
    return in_axes(foc::clarke(corrected(m, by)), foc::rotation(angle_of_phase(k))).d;
  }
  static constexpr bool plausible(const foc::Phases& by) {
    constexpr std::int32_t kLeast = 3072, kMost = 5461;  // three quarters to four thirds
    const auto fits = [](std::int32_t x) { return x >= kLeast && x <= kMost; };
    return fits(by.a) && fits(by.b) && fits(by.c);
  }
  static constexpr void correct(foc::SensorSettings& s, const foc::Phases& by) {
    s.offset = corrected({s.offset.a, s.offset.b, s.offset.c}, by);
    const auto gain = [](std::int32_t before, std::int32_t factor) { return (before * factor + kOne / 2) >> 12; };
    s.gain = {gain(s.gain.a, by.a), gain(s.gain.b, by.b), gain(s.gain.c, by.c)};
  }
  // The test current was not reached along a phase.
  constexpr bool is_weak(Context& c) const {
    int count = 0, most = 0;
    for (int k = 0; k < kDirections; ++k) {
      if (weak_[k] != 0) ++count;
      if (weak_[k] > weak_[most]) most = k;
    }
    // A bad contact is in all three directions, in its own one more than in the others.
    if (count == kDirections && !differ(c, weak_)) c.fail(Fault::voltage_too_low);
    if (count != 0) c.fail(Fault::resistances_differ, most + 1);
    return count != 0;
  }
  // Any three resistances between terminals are those of a star: a hard short shows as two that are far below the
  // third, a bad contact as one above the others.
  static constexpr bool differ(Context& c, const std::int32_t (&r)[kDirections]) {
    int high = 0, low = 0;
    for (int k = 1; k < kDirections; ++k) {
      if (r[k] > r[high]) high = k;
      if (r[k] < r[low]) low = k;
    }
    const std::int64_t most = r[high], least = r[low], middle = std::int64_t{r[0]} + r[1] + r[2] - most - least;
    if (5 * most < 6 * least) return false;
    if (most > 6 * middle) {
      c.fail(Fault::phases_shorted, high + 1);
    } else {
      c.fail(Fault::resistances_differ, (most - middle > middle - least ? high : low) + 1);
    }
    return true;
  }

  Part part_ = Part::rest;
  int direction_ = 0;
  int level_ = 0;
  std::int32_t count_ = 0;
  std::int32_t windows_ = 0;  // of this level
  std::int32_t before_ = 0;   // largest current of the last one
  std::int32_t voltage_ = 0;
  Level sum_;
  Level low_[kDirections];
  Level high_[kDirections];
  int silent_[kDirections]{};
  std::int32_t weak_[kDirections]{};  // resistance where the voltage ended, or zero
};

}  // namespace flexspline::control::commissioning
