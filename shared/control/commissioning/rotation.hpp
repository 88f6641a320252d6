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
  constexpr foc::RotorVector wanted(const Context& c) const {
    return {step_ == Step::does_it_turn && less_ ? c.settings.current - c.settings.current / 4 : c.settings.current, 0};
  }
  // The sample belongs to the angle that the vector has now; afterwards it has that of the next one.
  constexpr void update(Context& c, const foc::RotorVector& voltage) {
    const std::int32_t slow = c.settings.slow_step, target = step_ == Step::backward ? -slow : slow;
    if (!waited_) {
      if (vector_.step() == target && size_of_turn(vector_.turned() - since_) >= wait_) begin_part(c);
    } else if (step_ == Step::pole_pairs) {
      pole_pairs(c);
    } else if (step_ == Step::does_it_turn) {
      does_it_turn(c, voltage);
    } else {
      pass(c);
    }
    travel_ += c.now.moved;
    vector_.advance(step_ == Step::stop ? 0 : target, c.settings.step_ramp / 4);
  }
  constexpr bool done() const { return step_ == Step::stop && vector_.step() == 0; }

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
    lead_ = {};
    across_ = 0;
    count_ = 0;
    if (step_ != Step::backward) reference_ = lead(c);
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
  constexpr void pass(Context& c) {
    const auto now = static_cast<std::int32_t>(lead(c) - reference_);
    if (count_ == 0) lead_ = {0, now, now};
    lead_.sum += now;
    if (now < lead_.least) lead_.least = now;
    if (now > lead_.most) lead_.most = now;
    ++count_;
    if (size_of_turn(vector_.turned() - since_) < c.result.pole_pairs * kTurn) return;
    constexpr std::int64_t kMostChange = kTurn / 12, kMostRange = kTurn / 3;
    // Whole turns that a slip takes do not show in the angle.
    const std::int64_t rotor = travel_ * c.result.pole_pairs;
    const std::int64_t change = vector_.turned() - since_ - (c.result.reversed ? -rotor : rotor),
                       range = std::int64_t{lead_.most} - lead_.least;
    if (size_of_turn(change) > kMostChange || range > kMostRange) {
      // Reluctance can hold the rotor at either side of the vector; it changes once. A coupling slips again.
      return ++repeated_ > kRepeats ? go(Step::does_it_turn, 1) : go(step_, 1);
    }
    repeated_ = 0;
    const std::int32_t mean = ratio(lead_.sum, count_, 0);
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
  // The encoder does not follow the vector. A rotor that turns with it induces flux times speed, whatever the current
  // is; the rest of the voltage across the vector is in proportion to the current.
  constexpr void does_it_turn(Context& c, const foc::RotorVector& voltage) {
    across_ += voltage.q;
    ++count_;
    if (travel_ > furthest_) furthest_ = travel_;
    if (travel_ < nearest_) nearest_ = travel_;
    if (vector_.turned() - since_ < kCheckTurns * kTurn) return;
    const std::int32_t mean = ratio(across_, count_, 0);
    if (!less_) {
      // The range, as a slip may take back what the rotor moved.
      if ((furthest_ - nearest_) * (2 * kMostPolePairs) > kCheckTurns * kTurn) return c.fail(Fault::encoder_slips);
      whole_ = mean;
      less_ = true;
      return go(Step::does_it_turn, 1);
    }
    const std::int64_t induced = 4 * std::int64_t{mean} - 3 * std::int64_t{whole_};
    const bool turns = induced > c.settings.most_voltage / 512 && induced > whole_ / 16;
    c.fail(turns ? Fault::encoder_stands : Fault::rotor_blocked);
  }

  struct Lead {
    std::int64_t sum = 0;
    std::int32_t least = 0;
    std::int32_t most = 0;
  };
  TurningVector vector_;
  Step step_ = Step::pole_pairs;
  bool waited_ = false;
  std::int64_t wait_ = 2 * kTurn;
  std::int64_t since_ = 0;   // turned, where the part began
  std::int64_t travel_ = 0;  // of the encoder since then
  std::int64_t furthest_ = 0;
  std::int64_t nearest_ = 0;
  std::int32_t count_ = 0;
  int repeated_ = 0;
  std::uint32_t reference_ = 0;
  Lead lead_;
  std::int32_t forward_ = 0;
  std::int64_t across_ = 0;
  std::int32_t whole_ = 0;
  bool less_ = false;
};

}  // namespace flexspline::control::commissioning
