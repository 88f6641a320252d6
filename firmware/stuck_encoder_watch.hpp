// Whether the motor's encoder still counts. The count stays within kRestCounts although a torque must move the shaft:
// the encoder fails, or the shaft is blocked. Such a torque is one of three:
// - it changed by more than friction can hold, which is twice the breakaway torque; a blocked shaft still twists the
//   gear. Torque that alternates faster than the shaft follows does not move it, and the torque that braked it may last
//   until it is at rest within its last count: so the torque is smoothed, and is compared from a little after the last
//   motion, or from when the drive was armed;
// - or it is at its limit, and the velocity loop still demands motion. A load that holds the shaft looks the same;
// - or it goes on driving a shaft that turned, and that was not slowing down when its count stopped.
#pragma once

#include <cstdint>

#include "firmware/control.hpp"
#include "firmware/faults.hpp"

namespace flexspline::firmware {

class StuckEncoderWatch {
 public:
  // The drive is not armed: the next tick that is begins anew.
  void stop() { watches_ = false; }
  bool watches() const { return watches_; }
  // Once an armed tick. `last`: the command of the previous tick. True: the encoder is stuck.
  bool update(const Estimate& e, const Output& last, const Parameters& p) {
    const control::SafetyLimits<N>& limits = p.safety;
    const std::uint32_t settling_ticks = limits.stuck_ticks / kSettlingShare + 1U;
    const bool begins = !watches_;
    watches_ = true;
    smooth_torque(last.torque, begins);
    note_motion(e, limits, begins, settling_ticks);
    const N::Value range = torque_range(settling_ticks);
    const std::int32_t onward = driven_direction_ < 0 ? -smoothed_torque_.raw : smoothed_torque_.raw;
    const bool drives_on = driven_direction_ != 0 && onward > limits.stuck_torque.raw / 2;
    if (unmoved_ < settling_ticks || range > limits.stuck_torque || drives_on) ++unmoved_;
    const std::int32_t most = p.loops.torque_limit.raw;
    const bool at_limit = N::magnitude(smoothed_torque_).raw > most - (most >> 3);
    const bool stalls = at_limit && N::magnitude(last.error).raw > limits.standstill.raw >> 3;
    stalled_ = stalls ? stalled_ + 1 : 0;
    return unmoved_ >= settling_ticks + limits.stuck_ticks || stalled_ >= settling_ticks + limits.stuck_ticks;
  }
  N::Value smoothed_torque() const { return smoothed_torque_; }

 private:
  void smooth_torque(N::Value torque, bool begins) {
    smoothed_torque_.raw =
        begins ? torque.raw : smoothed_torque_.raw + ((torque.raw - smoothed_torque_.raw) >> kTorqueSmoothingLog2);
    twice_smoothed_torque_.raw =
        begins ? torque.raw
               : twice_smoothed_torque_.raw +
                     ((smoothed_torque_.raw - twice_smoothed_torque_.raw) >> kTorqueSmoothingLog2);
  }
  void note_motion(const Estimate& e, const control::SafetyLimits<N>& limits, bool begins,
                   std::uint32_t settling_ticks) {
    displacement_ += static_cast<std::uint32_t>(e.moved);
    const auto displacement = static_cast<std::int32_t>(displacement_);
    if (!begins && displacement <= kRestCounts && displacement >= -kRestCounts) return;
    last_direction_ = displacement < 0 ? -1 : 1;
    driven_direction_ = begins ? 0 : driven_direction(e, limits);
    displacement_ = 0;
    unmoved_ = begins ? settling_ticks : 0;
    stalled_ = 0;
    lowest_ = highest_ = twice_smoothed_torque_;
  }
  // By how much the torque changed since the shaft came to rest. While it does, torque against the motion brakes it and
  // is not counted; torque that rises in the direction of the motion is.
  N::Value torque_range(std::uint32_t settling_ticks) {
    if (unmoved_ < settling_ticks &&
        (last_direction_ < 0 ? smoothed_torque_ > lowest_ || smoothed_torque_ > N::Value{}
                             : smoothed_torque_ < highest_ || smoothed_torque_ < N::Value{}))
      lowest_ = highest_ = smoothed_torque_;
    if (smoothed_torque_ < lowest_) lowest_ = smoothed_torque_;
    if (smoothed_torque_ > highest_) highest_ = smoothed_torque_;
    return highest_ - lowest_;
  }
  // The direction in which the shaft turns if nothing slows it down, otherwise zero.
  static int driven_direction(const Estimate& e, const control::SafetyLimits<N>& limits) {
    const std::int32_t rest = limits.standstill.raw;
    if (e.velocity.raw > rest && e.acceleration.raw >= 0) return 1;
    if (e.velocity.raw < -rest && e.acceleration.raw <= 0) return -1;
    return 0;
  }

  bool watches_ = false;              // since the drive was armed
  std::uint32_t displacement_ = 0;    // of the motor from its position of rest, counts; wraps
  std::uint32_t unmoved_ = 0;         // ticks at rest with a torque that must move the shaft
  std::uint32_t stalled_ = 0;         // ticks at the limit of the torque without the demanded motion
  int last_direction_ = 0;            // of the last motion
  int driven_direction_ = 0;          // in which the shaft was driven when its count stopped; zero: it was not
  N::Value smoothed_torque_{};        // commanded
  N::Value twice_smoothed_torque_{};  // a motion is later than the torque that causes it
  N::Value lowest_{};                 // of the smoothed torque, since the shaft came to rest
  N::Value highest_{};                // likewise
};

}  // namespace flexspline::firmware
