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
  // `most_reading`: of the current, which no block can raise.
  FaultRecord check_samples(std::uint32_t tick, const Readings& r, bool needs_output, std::int32_t most_reading) {
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
    const std::int32_t reading = r.current < 0 ? -std::int32_t{r.current} : r.current;
    above_board_ = reading > most_reading && reading < kRail ? above_board_ + 1 : 0;
    expect(found, Fault::overcurrent, above_board_ < kOvercurrentTicks, r.current, most_reading);
    before_.motor_samples = r.motor_samples;
    before_.output_samples = r.output_samples;
    before_.analog_samples = r.analog_samples;
    return found;
  }

  // `last` is what the tick before commanded.
  // `streams`: set points have to come one after the other.
  FaultRecord check(std::uint32_t tick, const Readings& r, const Estimate& e, const Output& last, const Parameters& p,
                    Mode mode, bool streams) {
    FaultRecord found{Fault::none, tick, 0, 0};
    check_ranges(found, r, p);
    check_always(found, e, p.safety);
    if (is_armed(mode)) {
      check_output(found, r, e, p);
      check_motion(found, e, last, p);
      check_following(found, e, last, p, mode);
    } else {
      forget_motion();
    }
    if (may_be_commanded(mode))
      expect(found, Fault::host_lost, host_age_ < p.safety.host_ticks, host_age_, p.safety.host_ticks);
    if (streams && mode == Mode::position) {
      const std::uint32_t most =
          p.safety.host_ticks < kOldestSetPointTicks ? p.safety.host_ticks : kOldestSetPointTicks;
      expect(found, Fault::set_point_lost, set_point_age_ < most, set_point_age_, most);
    }
    if (host_age_ < UINT32_MAX) ++host_age_;
    if (set_point_age_ < UINT32_MAX) ++set_point_age_;
    return found;
  }
  // A command came.
  void host_is_there() { host_age_ = 0; }
  // A set point came.
  void set_point_is_there() { set_point_age_ = 0; }
  // The host armed a mode, be it from another one or the same.
  void begin_mode() { mode_ = Mode::boot; }

 private:
  static constexpr std::int32_t kRail = 32767;  // a reading here is none
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
    const bool over = N::magnitude(e.shown_current) > limits.overcurrent && current_outside_ == 0;
    over_current_ = over ? over_current_ + 1 : 0;
    expect(found, Fault::overcurrent, over_current_ < kOvercurrentTicks, e.shown_current.raw, limits.overcurrent.raw);
    if (turn_of(found.tick) == Turn::temperature_and_gear)
      hot_ = e.shown_temperature > limits.overtemperature ? hot_ + 1 : 0;
    expect(found, Fault::overtemperature, hot_ < kHotTicks / kTurns, e.shown_temperature.raw,
           limits.overtemperature.raw);
  }
  void check_motion(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p) {
    const control::SafetyLimits<N>& limits = p.safety;
    const std::int32_t most = limits.counts_a_tick;
    expect(found, Fault::motor_encoder_jump, e.moved <= most && e.moved >= -most, e.moved, most);
    expect(found, Fault::implausible_motion, N::magnitude(e.acceleration) <= limits.acceleration, e.acceleration.raw,
           limits.acceleration.raw);
    expect(found, Fault::overspeed, N::magnitude(e.velocity) <= limits.overspeed, e.velocity.raw, limits.overspeed.raw);
    const N::Value missing = N::magnitude(e.shown_current - last.current);
    mismatch_ = missing > limits.current_mismatch ? mismatch_ + 1 : 0;
    expect(found, Fault::current_mismatch, mismatch_ < limits.mismatch_ticks, missing.raw, limits.current_mismatch.raw);
    check_stuck(found, e, last, p);
  }
  // Nothing moves: the count stays within kRestCounts. Then a torque that must move the shaft shows that the encoder
  // does not tell, or that the shaft is blocked:
  // - it changed by more than friction can hold, which is twice the breakaway torque; a blocked shaft still twists the
  //   gear. Torque that goes to and fro faster than the shaft follows is none that it feels, and what braked it may
  //   last until it has come to rest within its last count: so the torque is smoothed, and counts from a little after
  //   the last motion, or from when the drive was armed;
  // - or it is at its limit, and the velocity loop still wants motion. A load that does not let go looks the same;
  // - or it drives on as before a shaft that turned, and that nothing had slowed down when its count stopped.
  void check_stuck(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p) {
    const control::SafetyLimits<N>& limits = p.safety;
    const std::uint32_t settling_ticks = limits.stuck_ticks / kSettlingShare + 1U;
    const bool begins = !watches_;
    watches_ = true;
    felt_.raw = begins ? last.torque.raw : felt_.raw + ((last.torque.raw - felt_.raw) >> kFeltTicksLog2);
    moved_by_.raw = begins ? last.torque.raw : moved_by_.raw + ((felt_.raw - moved_by_.raw) >> kFeltTicksLog2);
    strayed_ += static_cast<std::uint32_t>(e.moved);
    const auto strayed = static_cast<std::int32_t>(strayed_);
    if (begins || strayed > kRestCounts || strayed < -kRestCounts) {
      way_ = strayed < 0 ? -1 : 1;
      stopped_from_ = begins ? 0 : driven_direction(e, limits);
      strayed_ = 0;
      unmoved_ = begins ? settling_ticks : 0;
      stalled_ = 0;
      lowest_ = highest_ = moved_by_;
    }
    // While the shaft comes to rest, torque against the motion brakes it and does not count; torque that rises in the
    // direction of the motion does.
    if (unmoved_ < settling_ticks &&
        (way_ < 0 ? felt_ > lowest_ || felt_ > N::Value{} : felt_ < highest_ || felt_ < N::Value{}))
      lowest_ = highest_ = felt_;
    if (felt_ < lowest_) lowest_ = felt_;
    if (felt_ > highest_) highest_ = felt_;
    const N::Value span = highest_ - lowest_;
    const std::int32_t onward = stopped_from_ < 0 ? -felt_.raw : felt_.raw;
    const bool drives_on = stopped_from_ != 0 && onward > limits.stuck_torque.raw / 2;
    if (unmoved_ < settling_ticks || span > limits.stuck_torque || drives_on) ++unmoved_;
    const std::int32_t most = p.loops.torque_limit.raw;
    const bool at_limit = N::magnitude(felt_).raw > most - most / 8;
    const bool wants_motion = N::magnitude(last.error).raw > limits.standstill.raw / 8;
    stalled_ = at_limit && wants_motion ? stalled_ + 1 : 0;
    expect(found, Fault::motor_encoder_stuck,
           unmoved_ < settling_ticks + limits.stuck_ticks && stalled_ < settling_ticks + limits.stuck_ticks, felt_.raw,
           limits.stuck_torque.raw);
  }
  // Which way the shaft turns, where nothing slows it down; else zero.
  static int driven_direction(const Estimate& e, const control::SafetyLimits<N>& limits) {
    const std::int32_t rest = limits.standstill.raw;
    if (e.velocity.raw > rest && e.acceleration.raw >= 0) return 1;
    if (e.velocity.raw < -rest && e.acceleration.raw <= 0) return -1;
    return 0;
  }
  // The output moves with the motor, but for torsion and backlash. A line that is lost leaves a count that goes to and
  // fro, so a few counts are no motion. Without limits any count is enough, and nothing is watched.
  void check_output(FaultRecord& found, const Readings& r, const Estimate& e, const Parameters& p) {
    const control::FollowingLimits<N>& limits = p.following;
    turned_ += static_cast<std::uint32_t>(e.moved);
    const auto output = static_cast<std::int32_t>(r.output_counter - output_from_);
    if (output >= limits.output_counts || output <= -limits.output_counts || !watches_) {
      output_from_ = r.output_counter;
      turned_ = 0;
    }
    const auto turned = static_cast<std::int32_t>(turned_);
    const std::int32_t most = limits.motor_counts;
    expect(found, Fault::output_encoder_stuck, turned <= most && turned >= -most, turned, most);
    const bool in_turn = !watches_ || turn_of(found.tick) == Turn::temperature_and_gear;
    if (p.has_output_encoder && most > 0 && in_turn) check_gear(found, e, p);
  }
  // Both encoders show the same motion, but for torsion and backlash, since the drive was armed. The reference follows
  // slowly: a ratio is rounded in the parameters. What stands still at the output is found before.
  void check_gear(FaultRecord& found, const Estimate& e, const Parameters& p) {
    if (most_apart_ == 0) {
      const auto turns = static_cast<std::int64_t>(
          (std::uint64_t{static_cast<std::uint32_t>(p.following.motor_counts)} << 32) / p.motor_encoder.counts);
      const std::int64_t apart = N::times_order(N::Angle{turns}, p.feedforward.output_angle).raw;
      most_apart_ = apart + (apart >> 3);
    }
    const std::int64_t apart = (e.output_angle - N::times_order(e.angle, p.feedforward.output_angle)).raw;
    if (!watches_) apart_from_ = apart;
    // Angles wrap.
    const auto off =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(apart) - static_cast<std::uint64_t>(apart_from_));
    apart_from_ += off >> kDriftTurnsLog2;
    expect(found, Fault::encoders_disagree, off <= most_apart_ && off >= -most_apart_, off >> 8, most_apart_ >> 8);
  }
  // A host may begin a stream far from where the shaft is; the shaft is watched from when it has got there. In mode
  // velocity there is no position to follow, and in mode position another velocity than that of the set point is how
  // the loop works: as far behind as the position loop needs for a velocity, it asks for this velocity. So the window
  // is as wide as the speed of set point or shaft asks for, the latter where the shaft catches up.
  void check_following(FaultRecord& found, const Estimate& e, const Output& last, const Parameters& p, Mode mode) {
    const control::FollowingLimits<N>& limits = p.following;
    const N::Value closing = last.lag.raw < 0 ? -e.velocity : e.velocity;
    const N::Value wanted = N::magnitude(last.velocity);
    const std::int32_t full = p.loops.velocity_limit.raw;
    const std::int32_t speed = wanted > closing ? wanted.raw : closing.raw;
    const std::int32_t open =
        fixed::limited<std::int32_t>((speed < full ? speed : full) + (full >> kFollowingFloorLog2), 1, full);
    const std::uint32_t lag = in_a_word(last.lag.raw), window = in_a_word(limits.position);
    bool behind = fixed::long_product(lag, static_cast<std::uint32_t>(full)) >
                  fixed::long_product(window, static_cast<std::uint32_t>(open));
    if (mode == Mode::velocity) behind = N::magnitude(last.velocity - e.velocity) > limits.velocity;
    // When a mode begins, what was wanted last was wanted before.
    follows_ = mode == mode_ && (follows_ || !behind);
    mode_ = mode;
    lagging_ = behind && follows_ ? lagging_ + 1 : 0;
    if (limits.ticks == 0 || lagging_ < limits.ticks) return;
    expect(found, Fault::following_error, false, lag, std::int64_t{window} * open / full);
  }
  // The size of an angle in 2^-16 turns, of which 65536 are as good as more.
  static std::uint32_t in_a_word(std::int64_t angle) {
    const std::uint64_t size = fixed::size_of(angle);
    return (size >> 48) != 0 ? 0xFFFFFFFF : static_cast<std::uint32_t>(size >> 16);
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
  std::uint32_t set_point_age_ = 0;
  std::uint32_t torque_same_ = 0;
  std::uint32_t over_current_ = 0;
  std::uint32_t above_board_ = 0;
  std::uint32_t hot_ = 0;
  std::uint32_t mismatch_ = 0;
  std::uint32_t unmoved_ = 0;
  std::uint32_t stalled_ = 0;
  std::uint32_t strayed_ = 0;  // of the motor from where it rests, counts; wraps
  std::uint32_t lagging_ = 0;
  std::uint32_t output_from_ = 0;
  std::uint32_t turned_ = 0;  // of the motor since then, counts; wraps
  N::Value felt_{};           // torque, smoothed
  N::Value moved_by_{};       // smoothed again: a motion comes later than the torque that makes it
  N::Value lowest_{};
  N::Value highest_{};
  std::uint8_t current_outside_ = 0;
  std::uint8_t torque_outside_ = 0;
  std::uint8_t temperature_outside_ = 0;
  int way_ = 0;                  // of the last motion
  int stopped_from_ = 0;         // direction in which the shaft was driven when its count stopped
  std::int64_t apart_from_ = 0;  // between both encoders when the drive was armed, 2^-32 turns of the output
  std::int64_t most_apart_ = 0;  // zero: not known yet
  bool watches_ = false;
  bool follows_ = false;
  Mode mode_{};
};

}  // namespace flexspline::firmware
