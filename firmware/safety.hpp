// Checks at each tick whether the drive has to stop. The limits of torque, current and velocity of every command are
// part of the loops; the checks here are for the cases in which those are not enough.
#pragma once

#include <cstdint>

#include "firmware/control.hpp"
#include "firmware/faults.hpp"
#include "firmware/stuck_encoder_watch.hpp"

namespace flexspline::firmware {

class Safety {
 public:
  // Each writes the first fault into `found`, which has none yet; the caller adds the tick. A fault that switches off
  // replaces one that ends in a controlled stop, whose cause may last as long as the stop.

  // Without parameters there are no scales and no limits: it only checks that samples arrive. `most_reading`: the
  // largest reading of the current, which no block can raise. `output_ticks()`: as long as a sample of the output may
  // take; zero where there is none. It is called only where a sample is late.
  template <class OutputTicks>
  void check_samples(FaultRecord& found, const Readings& r, std::int32_t most_reading, OutputTicks&& output_ticks) {
    const bool all_new = r.motor_samples != before_.motor_samples && r.output_samples != before_.output_samples &&
                         r.analog_samples != before_.analog_samples;
    if (!all_new || waits_) [[unlikely]]
      count_stale(found, r, output_ticks());
    before_.motor_samples = r.motor_samples;
    before_.output_samples = r.output_samples;
    before_.analog_samples = r.analog_samples;
    const std::int32_t reading = r.current < 0 ? -std::int32_t{r.current} : r.current;
    above_board_ = reading > most_reading && reading < kRail ? above_board_ + 1 : 0;
    expect(found, Fault::overcurrent, above_board_ < kOvercurrentTicks, r.current, most_reading);
  }

  // `last`: the command of the previous tick. `streams`: whether set points have to arrive in time.
  template <class Streams>
  void check(FaultRecord& found, const Readings& r, const Estimate& e, const Output& last, const Parameters& p,
             Mode mode, std::uint32_t due, Streams&& streams) {
    check_ranges(found, r, p);
    check_always(found, e, p.safety, due);
    if (is_armed(mode)) {
      check_output(found, r, e, p, due);
      check_motion(found, e, last, p);
      check_following(found, e, last, p, mode);
    } else {
      forget_motion();
    }
    if (may_be_commanded(mode))
      expect(found, Fault::host_lost, host_age_ < p.safety.host_ticks, host_age_, p.safety.host_ticks);
    if (mode == Mode::position) {
      const std::uint32_t most =
          p.safety.host_ticks < kOldestSetPointTicks ? p.safety.host_ticks : kOldestSetPointTicks;
      expect(found, Fault::set_point_lost, set_point_age_ < most || !streams(), set_point_age_, most);
    }
    if (host_age_ < UINT32_MAX) ++host_age_;
    if (set_point_age_ < UINT32_MAX) ++set_point_age_;
  }
  // A command arrived.
  void note_host() { host_age_ = 0; }
  // A set point arrived.
  void note_set_point() { set_point_age_ = 0; }
  // The host armed a mode, from another one or from the same.
  void begin_mode() { mode_ = Mode::boot; }

 private:
  static constexpr std::int32_t kRail = 32767;  // a reading at this value is not valid
  // The usual case costs one comparison; the fault is recorded in a function of its own.
  template <class Seen, class Limit>
  static void expect(FaultRecord& found, Fault fault, bool holds, Seen seen, Limit limit) {
    if (!holds) [[unlikely]]
      note(found, fault, static_cast<std::int32_t>(seen), static_cast<std::int32_t>(limit));
  }
  [[gnu::noinline]] static void note(FaultRecord& found, Fault fault, std::int32_t seen, std::int32_t limit) {
    if (found.fault != Fault::none && (ends_in(found.fault) == SafeState::off || ends_in(fault) == SafeState::stop))
      return;
    found.fault = fault;
    found.seen = seen;
    found.limit = limit;
  }
  // A sample did not arrive, in this tick or in the one before.
  [[gnu::noinline]] void count_stale(FaultRecord& found, const Readings& r, std::uint32_t output_ticks) {
    motor_age_ = r.motor_samples == before_.motor_samples ? motor_age_ + 1 : 0;
    output_age_ = r.output_samples == before_.output_samples ? output_age_ + 1 : 0;
    analog_age_ = r.analog_samples == before_.analog_samples ? analog_age_ + 1 : 0;
    waits_ = (motor_age_ | output_age_ | analog_age_) != 0;
    const auto stale = [&](Fault fault, std::uint32_t age, std::uint32_t ticks) {
      const std::uint32_t most = ticks + kStaleTicks - 1;
      expect(found, fault, age < most, age, most);
    };
    stale(Fault::motor_encoder_stale, motor_age_, 1);
    if (output_ticks > 0) stale(Fault::output_encoder_stale, output_age_, output_ticks);
    stale(Fault::analog_stale, analog_age_, 1);
  }
  static bool is_inside(const control::AnalogScale<N>& scale, std::int16_t share) {
    return share > scale.lowest && share < scale.highest;
  }
  static bool is_within(std::int32_t x, std::int32_t most) { return fixed::limited_to(x, most) == x; }
  void check_range(FaultRecord& found, Fault fault, const control::AnalogScale<N>& scale, std::int16_t share,
                   std::uint8_t& count) {
    if (is_inside(scale, share)) {
      count = 0;
    } else if (count < kRangeTicks) {
      ++count;
    }
    expect(found, fault, count < kRangeTicks, share, share < 0 ? scale.lowest : scale.highest);
  }
  void check_ranges(FaultRecord& found, const Readings& r, const Parameters& p) {
    const bool inside = is_inside(p.current, r.current) && is_inside(p.temperature, r.temperature) &&
                        (!p.has_torque_sensor || is_inside(p.torque, r.torque));
    if (!inside || outside_) [[unlikely]]
      count_outside(found, r, p);
    if (!p.has_torque_sensor) return;
    if (r.torque != before_.torque) [[likely]] {
      before_.torque = r.torque;
      torque_same_ = 0;
    } else {
      count_same_torque(found, p);
    }
  }
  // A reading is not valid, in this tick or in the one before.
  [[gnu::noinline]] void count_outside(FaultRecord& found, const Readings& r, const Parameters& p) {
    check_range(found, Fault::current_out_of_range, p.current, r.current, current_outside_);
    check_range(found, Fault::temperature_out_of_range, p.temperature, r.temperature, temperature_outside_);
    if (p.has_torque_sensor) check_range(found, Fault::torque_out_of_range, p.torque, r.torque, torque_outside_);
    outside_ = (current_outside_ | temperature_outside_ | torque_outside_) != 0;
  }
  [[gnu::noinline]] void count_same_torque(FaultRecord& found, const Parameters& p) {
    if (torque_same_ < UINT32_MAX) ++torque_same_;
    const std::uint32_t most = p.safety.torque_same_ticks;
    expect(found, Fault::torque_stuck, most == 0 || torque_same_ < most, torque_same_, most);
  }
  void check_always(FaultRecord& found, const Estimate& e, const control::SafetyLimits<N>& limits, std::uint32_t due) {
    // A reading at the rail is not a measurement.
    const bool over = N::magnitude(e.shown_current) > limits.overcurrent && current_outside_ == 0;
    over_current_ = over ? over_current_ + 1 : 0;
    expect(found, Fault::overcurrent, over_current_ < kOvercurrentTicks, e.shown_current.raw, limits.overcurrent.raw);
    if ((due & kTemperatureAndGear) != 0) hot_ = e.shown_temperature > limits.overtemperature ? hot_ + 1 : 0;
    expect(found, Fault::overtemperature, hot_ < kHotTicks / kSlowTicks, e.shown_temperature.raw,
           limits.overtemperature.raw);
  }
  void check_motion(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p) {
    const control::SafetyLimits<N>& limits = p.safety;
    const std::int32_t most = limits.counts_a_tick;
    expect(found, Fault::motor_encoder_jump, is_within(e.moved, most), e.moved, most);
    expect(found, Fault::implausible_motion, N::magnitude(e.acceleration) <= limits.acceleration, e.acceleration.raw,
           limits.acceleration.raw);
    expect(found, Fault::overspeed, N::magnitude(e.velocity) <= limits.overspeed, e.velocity.raw, limits.overspeed.raw);
    const N::Value missing = N::magnitude(e.shown_current - last.current);
    mismatch_ = missing > limits.current_mismatch ? mismatch_ + 1 : 0;
    expect(found, Fault::current_mismatch, mismatch_ < limits.mismatch_ticks, missing.raw, limits.current_mismatch.raw);
    const bool is_stuck = stuck_encoder_.update(e, last, p);
    expect(found, Fault::motor_encoder_stuck, !is_stuck, stuck_encoder_.smoothed_torque().raw, limits.stuck_torque.raw);
  }
  // The output moves with the motor, except for torsion and backlash. With one line lost the count alternates, so a few
  // counts are not motion. Without limits any count is enough, and nothing is checked.
  void check_output(FaultRecord& found, const Readings& r, const Estimate& e, const Parameters& p, std::uint32_t due) {
    const control::FollowingLimits<N>& limits = p.following;
    turned_ += static_cast<std::uint32_t>(e.moved);
    const auto output = static_cast<std::int32_t>(r.output_counter - output_from_);
    if (output >= limits.output_counts || output <= -limits.output_counts || !stuck_encoder_.watches()) {
      output_from_ = r.output_counter;
      turned_ = 0;
    }
    const auto turned = static_cast<std::int32_t>(turned_);
    const std::int32_t most = limits.motor_counts;
    const bool shows_motion = is_within(turned, most);
    expect(found, Fault::output_encoder_stuck, shows_motion, turned, most);
    const bool is_due = !stuck_encoder_.watches() || (due & kTemperatureAndGear) != 0;
    // Not for an encoder that failed already: the motor's, with which the drive stops, is intact.
    if (shows_motion && p.has_output_encoder && most > 0 && is_due) check_gear(found, e, p);
  }
  // Since the drive was armed both encoders show the same motion, except for torsion and backlash. The reference
  // follows slowly, as the ratio is rounded in the parameters. An output that does not move is detected earlier.
  void check_gear(FaultRecord& found, const Estimate& e, const Parameters& p) {
    if (largest_difference_ == 0) {
      const auto turns = static_cast<std::int64_t>(
          (std::uint64_t{static_cast<std::uint32_t>(p.following.motor_counts)} << 32) / p.motor_encoder.counts);
      const std::int64_t difference = N::times_order(N::Angle{turns}, p.feedforward.output_angle).raw;
      largest_difference_ = difference + (difference >> 3);
    }
    const std::int64_t difference = (e.output_angle - N::times_order(e.angle, p.feedforward.output_angle)).raw;
    if (!stuck_encoder_.watches()) reference_difference_ = difference;
    // Angles wrap.
    const auto off = static_cast<std::int64_t>(static_cast<std::uint64_t>(difference) -
                                               static_cast<std::uint64_t>(reference_difference_));
    reference_difference_ += off >> kDriftStepsLog2;
    expect(found, Fault::encoders_disagree, off <= largest_difference_ && off >= -largest_difference_, off >> 8,
           largest_difference_ >> 8);
  }
  // A host may begin a stream far from the shaft; the error is checked once the shaft has reached it. In mode velocity
  // there is no position to follow. In mode position the velocity may differ from that of the set point: the position
  // loop turns a position error into a velocity. So the allowed error grows with the speed of the set point or of the
  // shaft, the latter while the shaft catches up.
  void check_following(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p, Mode mode) {
    const control::FollowingLimits<N>& limits = p.following;
    // When a mode begins, the last demand belongs to the previous mode.
    if (mode != mode_) [[unlikely]] {
      mode_ = mode;
      follows_ = false;
      lagging_ = 0;
      near_ = near_lag(limits, p);
      return;
    }
    const bool near = mode == Mode::velocity ? N::magnitude(last.velocity - e.velocity) <= limits.velocity
                                             : fixed::limited_to(last.lag.raw, near_) == last.lag.raw;
    if (near) [[likely]] {
      follows_ = true;
      lagging_ = 0;
    } else {
      check_lag(found, e, last, p, mode);
    }
  }
  // A lag that is allowed at any speed, so that most ticks need no multiplication: half of the smallest window, which
  // is 2^-kFollowingFloorLog2 of the full one, so that rounding does not matter.
  static std::int64_t near_lag(const control::FollowingLimits<N>& limits, const Parameters& p) {
    const std::uint32_t near = magnitude_word(limits.position) >> (kFollowingFloorLog2 + 1);
    return p.loops.velocity_limit.raw < 1 << (kFollowingFloorLog2 + 1) ? 0 : std::int64_t{near} << 16;
  }
  [[gnu::noinline]] void check_lag(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p,
                                   Mode mode) {
    const control::FollowingLimits<N>& limits = p.following;
    const N::Value closing = last.lag.raw < 0 ? -e.velocity : e.velocity;
    const N::Value set_speed = N::magnitude(last.velocity);
    const std::int32_t full = p.loops.velocity_limit.raw;
    const std::int32_t speed = set_speed > closing ? set_speed.raw : closing.raw;
    const std::int32_t open =
        fixed::limited<std::int32_t>((speed < full ? speed : full) + (full >> kFollowingFloorLog2), 1, full);
    const std::uint32_t lag = magnitude_word(last.lag.raw), window = magnitude_word(limits.position);
    bool behind = fixed::long_product(lag, static_cast<std::uint32_t>(full)) >
                  fixed::long_product(window, static_cast<std::uint32_t>(open));
    if (mode == Mode::velocity) behind = true;
    follows_ = follows_ || !behind;
    lagging_ = behind && follows_ ? lagging_ + 1 : 0;
    if (limits.ticks == 0 || lagging_ < limits.ticks) return;
    expect(found, Fault::following_error, false, lag, std::int64_t{window} * open / full);
  }
  // The magnitude of an angle in 2^-16 turns, limited to 65536 turns.
  static std::uint32_t magnitude_word(std::int64_t angle) {
    const std::uint64_t size = fixed::size_of(angle);
    return (size >> 48) != 0 ? 0xFFFFFFFF : static_cast<std::uint32_t>(size >> 16);
  }
  void forget_motion() {
    stuck_encoder_.stop();
    mismatch_ = 0;
    host_age_ = 0;
  }

  Readings before_{};
  std::uint32_t motor_age_ = 0;
  std::uint32_t output_age_ = 0;
  std::uint32_t analog_age_ = 0;
  std::uint32_t host_age_ = 0;
  std::uint32_t set_point_age_ = 0;
  std::uint32_t torque_same_ = 0;
  std::uint32_t over_current_ = 0;
  std::uint32_t above_board_ = 0;
  std::uint32_t hot_ = 0;
  std::uint32_t mismatch_ = 0;
  std::uint32_t lagging_ = 0;
  std::uint32_t output_from_ = 0;
  std::uint32_t turned_ = 0;  // of the motor since then, counts; wraps
  StuckEncoderWatch stuck_encoder_{};
  std::uint8_t current_outside_ = 0;
  std::uint8_t torque_outside_ = 0;
  std::uint8_t temperature_outside_ = 0;
  std::int64_t reference_difference_ = 0;  // between both encoders when the drive was armed, 2^-32 turns of the output
  std::int64_t largest_difference_ = 0;    // zero: not known yet
  std::int64_t near_ = 0;                  // a lag of the position that is allowed at any speed
  bool waits_ = false;                     // for a sample that is older than a tick
  bool outside_ = false;                   // a reading was not valid
  bool follows_ = false;
  Mode mode_{};
};

}  // namespace flexspline::firmware
