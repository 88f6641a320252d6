// A current vector that turns slowly, forward and back, with the rotor behind it: pole pairs, direction and angle of
// the encoder. Friction holds the rotor behind the vector by the same angle in both directions, so their mean is
// without it; each is a mean over a turn of the rotor, so that cogging and an eccentric encoder drop out.
#pragma once

#include <cstdint>

#include "shared/control/commissioning/context.hpp"

namespace flexspline::control::commissioning {

// Electrical angle of the rotor by its encoder, as it was found.
constexpr std::uint32_t turned_angle(const Result& r, std::uint32_t encoder) {
  const std::uint32_t turned = encoder * static_cast<std::uint32_t>(r.pole_pairs);
  return r.reversed ? 0 - turned : turned;
}
constexpr std::uint32_t rotor_angle(const Result& r, std::uint32_t encoder) {
  return turned_angle(r, encoder) + r.offset_angle;
}

class RotationTest {
 public:
  constexpr void begin(std::uint32_t angle) {
    *this = {};
    vector_.place(angle);
  }
  constexpr const TurningVector& vector() const { return vector_; }
  constexpr Step step() const { return step_; }

  // Current wanted along the vector, in its frame.
  constexpr foc::RotorVector wanted(const Context& c) const { return {c.settings.current, 0}; }
  // The sample belongs to the angle that the vector has now; afterwards it has that of the next one. `voltage`: what
  // the motor has of it along and across the vector.
  constexpr void update(Context& c, const foc::RotorVector& voltage) {
    travel_ += c.now.moved;
    const std::int32_t slow = step_ == Step::does_it_turn ? c.settings.slow_step : c.settings.slow_step >> slower_,
                       target = step_ == Step::backward ? -slow : slow;
    if (!waited_) {
      if (vector_.step() == target && size_of_turn(vector_.turned() - since_) >= wait_) begin_part(c);
    } else if (step_ == Step::pole_pairs) {
      pole_pairs(c);
    } else if (step_ == Step::does_it_turn) {
      if (!stops_) does_it_turn(c, voltage);
    } else {
      pass(c);
    }
    vector_.advance(step_ == Step::stop || stops_ ? 0 : target, c.settings.step_ramp / 4);
  }
  constexpr bool done() const { return step_ == Step::stop && vector_.step() == 0; }
  // The vector stands for `does_it_turn`, which needs the inductances.
  constexpr bool stands() const { return stops_ && vector_.step() == 0; }
  // A standing rotor answers the turning current with the voltage of its inductances, in the mean over an electrical
  // turn with the mean of both, w I (Ld + Lq)/2. One that turns induces w flux, and has its d along the vector as long
  // as the magnet is stronger there than reluctance, which leaves at least half of w flux above that mean; else
  // reluctance has turned it, and there is at least as much.
  constexpr void conclude_turning(Context& c, const Inductances& found) const {
    const std::int32_t mean = found.d / 2 + found.q / 2;
    const std::int32_t standing = induced_voltage(mean, c.settings.current, c.settings.slow_step);
    // What the inductances may be wrong by, and what is left of the legs' losses.
    const std::int64_t noise = standing / 32 + c.result.lost_voltage / 64;
    c.fail(std::int64_t{across_mean_} - standing > noise ? Fault::encoder_stands : Fault::rotor_blocked);
  }

 private:
  static constexpr std::int64_t kPolePairTurns = 8;
  static constexpr std::int64_t kMostPolePairs = 40;
  static constexpr std::int64_t kCheckTurns = 2;
  static constexpr int kRepeats = 2;

  static constexpr std::int64_t size_of_turn(std::int64_t x) { return x < 0 ? -x : x; }
  // Waits until the vector turns evenly and the rotor with it.
  constexpr void go(Step step, std::int64_t wait_turns) {
    step_ = step;
    waited_ = false;
    wait_ = wait_turns * kTurn;
    since_ = vector_.turned();
  }
  constexpr void begin_part(const Context& c) {
    waited_ = true;
    since_ = vector_.turned();
    travel_ = furthest_ = nearest_ = 0;
    all_ = first_ = last_ = {};
    least_ = most_ = 0;
    across_ = {};
    if (step_ != Step::backward) reference_ = lead(c);
    began_ = static_cast<std::int32_t>(lead(c) - reference_);
  }
  // Of the vector before the encoder.
  constexpr std::uint32_t lead(const Context& c) const {
    return vector_.angle() - turned_angle(c.result, c.now.encoder);
  }
  constexpr void pole_pairs(Context& c) {
    const std::int64_t turned = vector_.turned() - since_;
    if (turned < kPolePairTurns * kTurn) return;
    const std::int64_t moved = size_of_turn(travel_);
    if (moved * kMostPolePairs < turned) return go(Step::does_it_turn, 1);
    c.result.reversed = travel_ < 0;
    c.result.pole_pairs = (ratio(turned, moved, 8) + 128) >> 8;
    if (c.result.pole_pairs == 0) return c.fail(Fault::encoder_slips);
    go(Step::forward, 0);
  }
  // A turn of the rotor for the mean, and the vector's first turn again to compare with. Both are means, as harmonics
  // of the magnet's flux and cogging can make a rotor jump from tooth to tooth.
  constexpr void pass(Context& c) {
    // Of the vector since the part began; whole turns that a slip takes show as well.
    const std::int64_t turned = vector_.turned() - since_, rotor = travel_ * c.result.pole_pairs;
    const std::int64_t ahead = turned - (c.result.reversed ? -rotor : rotor);
    if (ahead < least_) least_ = ahead;
    if (ahead > most_) most_ = ahead;
    const std::int64_t whole = c.result.pole_pairs * kTurn, at = size_of_turn(turned);
    if (at < whole) all_.add(ahead);
    if (at < kTurn) first_.add(ahead);
    if (at >= whole) last_.add(ahead);
    if (at < whole + kTurn) return;
    constexpr std::int64_t kMostChange = kTurn / 12, kMostRange = kTurn / 2;
    const std::int64_t change = std::int64_t{last_.mean()} - first_.mean();
    if (size_of_turn(change) > kMostChange || most_ - least_ > kMostRange) {
      // Reluctance can hold the rotor at either side of the vector, and changes once; jumps can make it swing, less so
      // at half of the speed. A coupling slips again.
      if (slower_ < kRepeats) ++slower_;
      return ++repeated_ > kRepeats ? go(Step::does_it_turn, 1) : go(step_, 1);
    }
    repeated_ = 0;
    const std::int32_t mean = began_ + all_.mean();
    if (step_ == Step::forward) {
      forward_ = mean;
      return go(Step::backward, 1);
    }
    conclude(c, mean);
  }
  constexpr void conclude(Context& c, std::int32_t backward) {
    const std::int32_t lag = forward_ / 2 - backward / 2;
    constexpr std::int32_t kMostLag = static_cast<std::int32_t>(kTurn / 3);
    if (lag > kMostLag) return c.fail(Fault::rotor_blocked);
    if (lag < -kMostLag / 8) return c.fail(Fault::encoder_slips);
    c.result.lag = lag;
    c.result.offset_angle = reference_ + static_cast<std::uint32_t>(forward_ / 2 + backward / 2);
    const std::int32_t stated = c.settings.stated_pole_pairs;
    if (stated != 0 && stated != c.result.pole_pairs) return c.fail(Fault::wrong_pole_pairs);
    go(Step::stop, 0);
  }
  // The encoder does not follow the vector.
  constexpr void does_it_turn(Context& c, const foc::RotorVector& voltage) {
    across_.add(voltage.q);
    if (travel_ > furthest_) furthest_ = travel_;
    if (travel_ < nearest_) nearest_ = travel_;
    if (vector_.turned() - since_ < kCheckTurns * kTurn) return;
    // The range, as a slip may take back what the rotor moved.
    if ((furthest_ - nearest_) * (2 * kMostPolePairs) > kCheckTurns * kTurn) return c.fail(Fault::encoder_slips);
    across_mean_ = across_.mean();
    stops_ = true;
  }

  struct Mean {
    std::int64_t sum = 0;
    std::int32_t count = 0;
    constexpr void add(std::int64_t x) {
      sum += x;
      ++count;
    }
    constexpr std::int32_t mean() const { return ratio(sum, count, 0); }
  };
  TurningVector vector_;
  Step step_ = Step::pole_pairs;
  bool waited_ = false;
  std::int64_t wait_ = 2 * kTurn;
  std::int64_t since_ = 0;   // turned, where the part began
  std::int64_t travel_ = 0;  // of the encoder since then
  std::int64_t furthest_ = 0;
  std::int64_t nearest_ = 0;
  int repeated_ = 0;
  int slower_ = 0;  // exponent of two by which the slow speed is lower
  std::uint32_t reference_ = 0;
  std::int32_t began_ = 0;   // the lead where the part began, above the reference
  Mean all_, first_, last_;  // of what the vector is ahead since then
  std::int64_t least_ = 0;
  std::int64_t most_ = 0;
  std::int32_t forward_ = 0;
  Mean across_;
  std::int32_t across_mean_ = 0;
  bool stops_ = false;
};

}  // namespace flexspline::control::commissioning
