// Looks at each tick for what must stop the drive. The limits of torque, current and velocity that hold for every
// command are not here: they are part of the loops. Here is what remains when those do not help.
#pragma once

#include <cstdint>

#include "firmware/control.hpp"
#include "firmware/faults.hpp"

namespace flexspline::firmware {

class Safety {
 public:
  // Without parameters there are no scales and no limits: only whether samples come. Returns the first fault found.
  FaultRecord check_samples(std::uint32_t tick, const Readings& r, bool needs_output) {
    motor_age_ = r.motor_samples == before_.motor_samples ? motor_age_ + 1 : 0;
    output_age_ = r.output_samples == before_.output_samples ? output_age_ + 1 : 0;
    analog_age_ = r.analog_samples == before_.analog_samples ? analog_age_ + 1 : 0;
    FaultRecord found{Fault::none, tick, 0, 0};
    const auto stale = [&](Fault fault, std::uint32_t age) {
      expect(found, fault, age < kStaleTicks, age, kStaleTicks);
    };
    stale(Fault::motor_encoder_stale, motor_age_);
    if (needs_output) stale(Fault::output_encoder_stale, output_age_);
    stale(Fault::analog_stale, analog_age_);
    before_.motor_samples = r.motor_samples;
    before_.output_samples = r.output_samples;
    before_.analog_samples = r.analog_samples;
    return found;
  }

  // `last` is what the tick before commanded.
  FaultRecord check(std::uint32_t tick, const Readings& r, const Estimate& e, const Output& last, const Parameters& p,
                    Mode mode) {
    FaultRecord found{Fault::none, tick, 0, 0};
    check_ranges(found, r, p);
    check_always(found, e, p.safety);
    if (is_armed(mode)) {
      check_output(found, r, e, p.following);
      check_motion(found, e, last, p.safety);
      check_following(found, e, last, p.following, mode);
    } else {
      forget_motion();
    }
    if (may_be_commanded(mode))
      expect(found, Fault::host_lost, host_age_ < p.safety.host_ticks, host_age_, p.safety.host_ticks);
    if (host_age_ < UINT32_MAX) ++host_age_;
    return found;
  }
  // A command came.
  void host_is_there() { host_age_ = 0; }
  // The host armed a mode, be it from another one or the same.
  void begin_mode() { mode_ = Mode::boot; }

 private:
  template <class Seen, class Limit>
  static void expect(FaultRecord& found, Fault fault, bool holds, Seen seen, Limit limit) {
    if (holds || found.fault != Fault::none) return;
    found = {fault, found.tick, static_cast<std::int32_t>(seen), static_cast<std::int32_t>(limit)};
  }
  void check_range(FaultRecord& found, Fault fault, const control::AnalogScale<N>& scale, std::int16_t share,
                   std::uint8_t& count) {
    const bool inside = share > scale.lowest && share < scale.highest;
    if (inside) {
      count = 0;
    } else if (count < kRangeTicks) {
      ++count;
    }
    expect(found, fault, count < kRangeTicks, share, share < 0 ? scale.lowest : scale.highest);
  }
  void check_ranges(FaultRecord& found, const Readings& r, const Parameters& p) {
    check_range(found, Fault::current_out_of_range, p.current, r.current, current_outside_);
    check_range(found, Fault::temperature_out_of_range, p.temperature, r.temperature, temperature_outside_);
    if (!p.has_torque_sensor) return;
    check_range(found, Fault::torque_out_of_range, p.torque, r.torque, torque_outside_);
    torque_same_ = r.torque == before_.torque && torque_same_ < UINT16_MAX ? torque_same_ + 1U : 0U;
    before_.torque = r.torque;
    const std::uint32_t most = p.safety.torque_same_ticks;
    expect(found, Fault::torque_stuck, most == 0 || torque_same_ < most, torque_same_, most);
  }
  void check_always(FaultRecord& found, const Estimate& e, const control::SafetyLimits<N>& limits) {
    // A reading at the rail is no current.
    const bool over = N::magnitude(e.current) > limits.overcurrent && current_outside_ == 0;
    over_current_ = over ? over_current_ + 1 : 0;
    expect(found, Fault::overcurrent, over_current_ < kOvercurrentTicks, e.current.raw, limits.overcurrent.raw);
    hot_ = e.temperature > limits.overtemperature ? hot_ + 1 : 0;
    expect(found, Fault::overtemperature, hot_ < kHotTicks, e.temperature.raw, limits.overtemperature.raw);
  }
  void check_motion(FaultRecord& found, const Estimate& e, const Output& last, const control::SafetyLimits<N>& limits) {
    const std::int32_t most = limits.counts_a_tick;
    expect(found, Fault::motor_encoder_jump, e.moved <= most && e.moved >= -most, e.moved, most);
    expect(found, Fault::implausible_motion, N::magnitude(e.acceleration) <= limits.acceleration, e.acceleration.raw,
           limits.acceleration.raw);
    expect(found, Fault::overspeed, N::magnitude(e.velocity) <= limits.overspeed, e.velocity.raw, limits.overspeed.raw);
    const N::Value missing = N::magnitude(e.current - last.current);
    mismatch_ = missing > limits.current_mismatch ? mismatch_ + 1 : 0;
    expect(found, Fault::current_mismatch, mismatch_ < limits.mismatch_ticks, missing.raw, limits.current_mismatch.raw);
    check_stuck(found, e, last, limits);
  }
  // A shaft that friction holds stays within twice its breakaway torque; beyond that it moves, if only by the torsion
  // of the gear. Torque that goes to and fro faster than the shaft follows is none that it feels, and what braked it
  // may last until it has come to rest within its last count: so the torque is smoothed, and counts from a little after
  // the last motion, or from when the drive was armed.
  void check_stuck(FaultRecord& found, const Estimate& e, const Output& last, const control::SafetyLimits<N>& limits) {
    const std::uint32_t settles = limits.stuck_ticks / kSettlingShare + 1U;
    const bool begins = !watches_;
    watches_ = true;
    felt_.raw = begins ? last.torque.raw : felt_.raw + ((last.torque.raw - felt_.raw) >> kFeltTicksLog2);
    if (begins) unmoved_ = settles;
    if (e.moved != 0) unmoved_ = 0;
    if (begins || unmoved_ < settles) lowest_ = highest_ = felt_;
    if (felt_ < lowest_) lowest_ = felt_;
    if (felt_ > highest_) highest_ = felt_;
    const N::Value span = highest_ - lowest_;
    if (unmoved_ < settles || span > limits.stuck_torque) ++unmoved_;
    expect(found, Fault::motor_encoder_stuck, unmoved_ < settles + limits.stuck_ticks, span.raw,
           limits.stuck_torque.raw);
  }
  // The output moves with the motor, but for torsion and backlash. A line that is lost leaves a count that goes to and
  // fro, so a few counts are no motion. Without limits any count is enough, and nothing is watched.
  void check_output(FaultRecord& found, const Readings& r, const Estimate& e,
                    const control::FollowingLimits<N>& limits) {
    turned_ += static_cast<std::uint32_t>(e.moved);
    const auto output = static_cast<std::int32_t>(r.output_counter - output_from_);
    if (output >= limits.output_counts || output <= -limits.output_counts || !watches_) {
      output_from_ = r.output_counter;
      turned_ = 0;
    }
    const auto turned = static_cast<std::int32_t>(turned_);
    const std::int32_t most = limits.motor_counts;
    expect(found, Fault::output_encoder_stuck, turned <= most && turned >= -most, turned, most);
  }
  // A host may begin a stream far from where the shaft is; the shaft is watched from when it has got there. In mode
  // velocity there is no position to follow, and in mode position another velocity than that of the set point is how
  // the loop works.
  void check_following(FaultRecord& found, const Estimate& e, const Output& last,
                       const control::FollowingLimits<N>& limits, Mode mode) {
    const auto lag = static_cast<std::int64_t>(fixed::size_of(last.lag.raw));
    bool behind = lag > limits.position;
    if (mode == Mode::velocity) behind = N::magnitude(last.velocity - e.velocity) > limits.velocity;
    // When a mode begins, what was wanted last was wanted before.
    follows_ = mode == mode_ && (follows_ || !behind);
    mode_ = mode;
    lagging_ = behind && follows_ ? lagging_ + 1 : 0;
    expect(found, Fault::following_error, limits.ticks == 0 || lagging_ < limits.ticks, lag >> 16,
           limits.position >> 16);
  }
  void forget_motion() {
    watches_ = false;
    mismatch_ = 0;
    host_age_ = 0;
  }

  Readings before_{};
  std::uint32_t motor_age_ = 0;
  std::uint32_t output_age_ = 0;
  std::uint32_t analog_age_ = 0;
  std::uint32_t host_age_ = 0;
  std::uint32_t torque_same_ = 0;
  std::uint32_t over_current_ = 0;
  std::uint32_t hot_ = 0;
  std::uint32_t mismatch_ = 0;
  std::uint32_t unmoved_ = 0;
  std::uint32_t lagging_ = 0;
  std::uint32_t output_from_ = 0;
  std::uint32_t turned_ = 0;  // of the motor since then, counts; wraps
  N::Value felt_{};           // torque, smoothed
  N::Value lowest_{};
  N::Value highest_{};
  std::uint8_t current_outside_ = 0;
  std::uint8_t torque_outside_ = 0;
  std::uint8_t temperature_outside_ = 0;
  bool watches_ = false;
  bool follows_ = false;
  Mode mode_{};
};

}  // namespace flexspline::firmware
